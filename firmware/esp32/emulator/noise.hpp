// Normal noise that is the same for the same seed.
#pragma once

#include <cmath>
#include <cstdint>

namespace chladni::emulator {

class Noise {
 public:
  explicit Noise(uint32_t seed = 0) : state_(seed * 2654435761U + 1U) {}
  // Of a standard deviation of 1.
  double next() { return std::sqrt(-2.0 * std::log(share())) * std::cos(kTwoPi * share()); }

 private:
  static constexpr double kTwoPi = 6.283185307179586;

  // Between 0 and 1, neither of them.
  double share() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return (static_cast<double>(state_) + 0.5) / 4294967296.0;
  }

  uint32_t state_;
};

}  // namespace chladni::emulator
