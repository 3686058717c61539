// Sine and cosine of a 32-bit phase in Q15, from a quarter wave with linear interpolation.
#pragma once

#include <cstdint>

#include "core/generated/sine_table.hpp"

namespace chladni {

struct SineCosine {
  int32_t sine_q15;
  int32_t cosine_q15;
};

// sin of the first quarter at `phase_q30` = 0 to 2^30 (both ends included).
inline int32_t quarter_sine_q15(uint32_t phase_q30) {
  constexpr uint32_t kFractionBits = 22;  // 30 bits less the table's 8
  const uint32_t index = phase_q30 >> kFractionBits;
  if (index >= kSineQuarterPoints) return kSineQuarterQ15[kSineQuarterPoints];
  const int32_t low = kSineQuarterQ15[index];
  const int32_t high = kSineQuarterQ15[index + 1];
  // The step is at most 201, so 15 bits of fraction keep the product in 23.
  const auto fraction_q15 = static_cast<int32_t>((phase_q30 >> (kFractionBits - 15)) & 0x7FFFU);
  return low + (((high - low) * fraction_q15 + 0x4000) >> 15);
}

inline SineCosine sine_cosine(uint32_t phase_u32) {
  const uint32_t rising = phase_u32 & 0x3FFFFFFFU;
  const int32_t up = quarter_sine_q15(rising);
  const int32_t down = quarter_sine_q15(0x40000000U - rising);
  switch (phase_u32 >> 30) {
    case 0: return {up, down};
    case 1: return {down, -up};
    case 2: return {-up, -down};
    default: return {-down, up};
  }
}

}  // namespace chladni
