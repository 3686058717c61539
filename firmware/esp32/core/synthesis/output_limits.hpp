// What outputs are never driven beyond. Numbers come from the board file, by way of the
// configuration in flash (docs/hardware.md).
#pragma once

#include <array>
#include <cstdint>

namespace chladni {

constexpr uint32_t kMaxChannels = 16;
// What a supply delivers is limited as its mean over any time so long.
constexpr uint32_t kSupplyWindowMs = 64;

// What drives and streams are reckoned against. The rest is for what is not known beforehand.
constexpr uint32_t reckoned_limit(uint32_t supply_ma) { return supply_ma - supply_ma / 32U; }

struct OutputLimits {
  uint32_t max_duty_q15 = 32768;  // ceiling of every duty
  uint32_t min_on_steps = 0;      // shortest pulse that still switches: the least of a wave
  uint32_t supply_ma = 0;         // delivered to all channels; 0: no limit
  // Current of a channel at a duty of 1.
  std::array<uint16_t, kMaxChannels> full_current_ma{};
};

// Largest whole number whose square is not above `value`.
inline uint32_t square_root(uint32_t value) {
  uint32_t root = 0;
  for (uint32_t bit = 1U << 15; bit != 0; bit >>= 1) {
    const uint32_t trial = root | bit;
    if (trial * trial <= value) root = trial;
  }
  return root;
}

// A share of a share, both 15 bits; all of it is all of it.
inline uint32_t share_q15(uint32_t value, uint32_t of_q15) {
  return of_q15 >= 32767U ? value : (value * of_q15) >> 15;
}

// `value` * `part` / `whole` for part <= whole, rounded down, to 15 bits.
inline uint32_t share_of(uint32_t value, uint32_t part, uint32_t whole) {
  while (whole > 0xFFFFU) {
    whole = (whole + 1U) >> 1;
    part >>= 1;
  }
  return whole == 0 ? value : value * ((part << 15) / whole) >> 15;
}

}  // namespace chladni
