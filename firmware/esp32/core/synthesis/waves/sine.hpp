// Sine and cosine of a 32-bit phase in Q15, from a quarter wave with linear interpolation.
#pragma once

#include <cstdint>

#include "core/generated/sine_table.hpp"

namespace chladni {

struct SineCosine {
  int32_t sine_q15;
  int32_t cosine_q15;
};

inline SineCosine sine_cosine(uint32_t phase_u32) {
  constexpr uint32_t kFractionBits = 22;  // a quarter's 30 bits less the table's 8
  const uint32_t index = (phase_u32 >> kFractionBits) & (kSineQuarterPoints - 1U);
  // The step is at most 201, so 15 bits of fraction keep the product in 23.
  const auto fraction_q15 = static_cast<int32_t>((phase_u32 >> (kFractionBits - 15)) & 0x7FFFU);
  // The cosine goes down the table as the sine goes up, by the same fraction.
  const int16_t* const rise = &kSineQuarterQ15[index];
  const int16_t* const fall = &kSineQuarterQ15[kSineQuarterPoints - index];
  const int32_t up = rise[0] + (((rise[1] - rise[0]) * fraction_q15 + 0x4000) >> 15);
  const int32_t down = fall[0] + (((fall[-1] - fall[0]) * fraction_q15 + 0x4000) >> 15);
  switch (phase_u32 >> 30) {
    case 0: return {up, down};
    case 1: return {down, -up};
    case 2: return {-up, -down};
    default: return {-down, up};
  }
}

}  // namespace chladni
