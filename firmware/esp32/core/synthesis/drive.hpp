// A drive, which is what every channel is played with, and the load that it is to the coils.
#pragma once

#include <array>
#include <cstdint>

#include "core/synthesis/output_limits.hpp"

namespace chladni {

// In-phase and quadrature gain of one channel: a sine is I cos(wt) - Q sin(wt).
struct Gain {
  int16_t in_phase_q15;
  int16_t quadrature_q15;
};

// A gain times a factor of 15 bits, -32767 to 32768, rounded.
constexpr Gain scaled(Gain gain, int32_t factor_q15) {
  const auto one = [factor_q15](int16_t value) {
    return static_cast<int16_t>((value * factor_q15 + (1 << 14)) >> 15);
  };
  return {one(gain.in_phase_q15), one(gain.quadrature_q15)};
}

using Drive = std::array<Gain, kMaxChannels>;

// What a channel's coil gets: means of its duty and of its square, 65536 for a duty of 1.
struct Load {
  uint32_t mean_q16;
  uint32_t square_q16;
};

using Loads = std::array<Load, kMaxChannels>;

}  // namespace chladni
