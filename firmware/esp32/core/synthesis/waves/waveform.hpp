// Waves other than the sine, of a 32-bit phase, in Q15.
//
// Each peaks at 1, and its first harmonic is a cosine's: phase 0 is that harmonic's maximum. As a
// share of a sine of the same peak it is 8/pi^2 (triangle), 4/pi (square) and 2/pi (ramp).
// The jumps of square and ramp are spread over the two samples around them by a second-order
// polynomial (PolyBLEP: Valimaki and Huovilainen, IEEE SPM 24(2), 2007), which keeps most of what
// lies above half the sample rate from folding back into the band that a finger feels.
#pragma once

#include <cstdint>

#include "core/generated/device_codes.hpp"

namespace chladni {

constexpr int32_t kOneQ15 = 32767;

// Turns a phase into a share of the step between two samples; made again when the step changes.
struct EdgeScale {
  uint32_t step_u32 = 1;
  uint32_t shift = 0;
  uint32_t reciprocal_q30 = 0;  // of the step >> shift, which has 16 bits

  // For a step below 2^31.
  static EdgeScale of(uint32_t step_u32) {
    EdgeScale scale;
    scale.step_u32 = step_u32 > 0 ? step_u32 : 1U;
    while ((scale.step_u32 >> scale.shift) >= (1U << 16)) ++scale.shift;
    // A little less than the reciprocal, so that a share is never above 32767.
    scale.reciprocal_q30 = ((1U << 30) - (1U << 15)) / ((scale.step_u32 >> scale.shift) + 1U);
    return scale;
  }

  // `phase` below the step.
  int32_t share_q15(uint32_t phase) const {
    return static_cast<int32_t>(((phase >> shift) * reciprocal_q30) >> 15);
  }
};

// What is left of the way to a jump's edge `distance` away, squared: 1 at the edge, and 0 from a
// sample away. On both sides a jump from -1 to 1 is brought towards 0 by it.
inline int32_t nearness_q15(uint32_t distance, const EdgeScale& scale) {
  const int32_t rest = kOneQ15 - scale.share_q15(distance);
  return (rest * rest) >> 15;
}

inline int32_t triangle_q15(uint32_t phase_u32) {
  // From 1 at phase 0 down to -1 at half a turn and back.
  const auto folded = static_cast<int32_t>((phase_u32 ^ (0U - (phase_u32 >> 31))) >> 15);
  return kOneQ15 - folded;
}

inline int32_t square_q15(uint32_t phase_u32, const EdgeScale& scale) {
  // Up a quarter before phase 0, down a quarter after it: half a turn from edge to edge.
  const uint32_t from_rise = phase_u32 + 0x40000000U;
  int32_t size = kOneQ15;
  const uint32_t from_edge = from_rise & 0x7FFFFFFFU;
  const uint32_t distance = from_edge < 0x40000000U ? from_edge : 0x80000000U - from_edge;
  if (distance < scale.step_u32) size -= nearness_q15(distance, scale);
  return (from_rise >> 31) == 0 ? size : -size;
}

inline int32_t ramp_q15(uint32_t phase_u32, const EdgeScale& scale) {
  // Rises through a turn from a quarter after phase 0, then falls at once.
  const uint32_t from_fall = phase_u32 - 0x40000000U;
  const int32_t value = static_cast<int32_t>(from_fall >> 16) - 32768;
  const bool is_after = (from_fall >> 31) == 0;
  const uint32_t distance = is_after ? from_fall : 0U - from_fall;
  if (distance >= scale.step_u32) return value;
  const int32_t correction = nearness_q15(distance, scale);
  return is_after ? value + correction : value - correction;
}

}  // namespace chladni
