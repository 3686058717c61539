// Waves other than the sine, of a 32-bit phase, in Q15.
//
// Each peaks at 1, and its first harmonic is a cosine's: phase 0 is that harmonic's maximum. As a
// share of a sine of the same peak it is 8/pi^2 (triangle), 4/pi (square) and 2/pi (ramp).
// The jumps of square and ramp are spread over the two samples around them by a second-order
// polynomial (PolyBLEP: Valimaki and Huovilainen, IEEE SPM 24(2), 2007), which keeps most of what
// lies above half the sample rate from folding back into the band that a finger feels.
#pragma once

#include <cstdint>

namespace chladni {

enum class Waveform : uint8_t { kSine = 0, kTriangle = 1, kSquare = 2, kRamp = 3 };
constexpr uint32_t kWaveforms = 4;

constexpr int32_t kOneQ15 = 32767;

// Turns a phase into a share of the step between two samples; made anew when the step changes.
struct EdgeScale {
  uint32_t step_u32 = 1;
  uint32_t shift = 0;
  uint32_t reciprocal_q30 = 0;  // of the step >> shift, which has 16 bits

  // For a step below 2^31.
  static EdgeScale of(uint32_t step_u32) {
    EdgeScale scale;
    scale.step_u32 = step_u32 > 0 ? step_u32 : 1U;
    while ((scale.step_u32 >> scale.shift) >= (1U << 16)) ++scale.shift;
    scale.reciprocal_q30 = (1U << 30) / (scale.step_u32 >> scale.shift);
    return scale;
  }

  // `phase` below the step.
  int32_t share_q15(uint32_t phase) const {
    const uint32_t share = ((phase >> shift) * reciprocal_q30) >> 15;
    return share > 32767U ? kOneQ15 : static_cast<int32_t>(share);
  }
};

// What a jump from -1 to 1 at phase 0 lacks.
inline int32_t edge_q15(uint32_t phase_u32, const EdgeScale& scale) {
  if (phase_u32 < scale.step_u32) {
    const int32_t rest = kOneQ15 - scale.share_q15(phase_u32);
    return -((rest * rest) >> 15);
  }
  const uint32_t ahead = 0U - phase_u32;
  if (ahead < scale.step_u32) {
    const int32_t rest = kOneQ15 - scale.share_q15(ahead);
    return (rest * rest) >> 15;
  }
  return 0;
}

inline int32_t triangle_q15(uint32_t phase_u32) {
  // From 1 at phase 0 down to -1 at half a turn and back.
  const auto folded = static_cast<int32_t>((phase_u32 ^ (0U - (phase_u32 >> 31))) >> 15);
  return kOneQ15 - folded;
}

inline int32_t square_q15(uint32_t phase_u32, const EdgeScale& scale) {
  // Up a quarter before phase 0, down a quarter after it.
  const uint32_t from_rise = phase_u32 + 0x40000000U;
  const int32_t level = (from_rise >> 31) == 0 ? kOneQ15 : -kOneQ15;
  return level + edge_q15(from_rise, scale) - edge_q15(from_rise + 0x80000000U, scale);
}

inline int32_t ramp_q15(uint32_t phase_u32, const EdgeScale& scale) {
  // Rises through a turn from a quarter after phase 0, then falls at once.
  const uint32_t from_fall = phase_u32 - 0x40000000U;
  return static_cast<int32_t>(from_fall >> 16) - 32768 - edge_q15(from_fall, scale);
}

}  // namespace chladni
