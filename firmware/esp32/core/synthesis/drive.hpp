// A drive, which is what every channel is played with, and what the coils have got of it.
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

// What the channels' pins got over some time: the integral of duty², 65536 for a duty of 1 that
// lasts a millisecond. Heat goes by it, and so does what a supply delivers: it feeds a coil only
// while its switch is on, and so gives duty times the coil's current, which is itself duty times
// that of a duty of 1.
using Squares = std::array<uint32_t, kMaxChannels>;

}  // namespace chladni
