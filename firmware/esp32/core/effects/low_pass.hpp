// The low-pass of signals: what boards cannot focus is taken out (tables/chladni/effects).
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/low_pass_sections.hpp"

namespace chladni {

class LowPass {
 public:
  void rest() { states_ = {}; }
  // Transposed form II, section after section.
  float next(float value) {
    for (uint32_t k = 0; k < kLowPassSections; ++k) {
      const std::array<float, 5>& own = kLowPass[k];
      std::array<float, 2>& state = states_[k];
      const float out = own[0] * value + state[0];
      state[0] = own[1] * value - own[3] * out + state[1];
      state[1] = own[2] * value - own[4] * out;
      value = out;
    }
    return value;
  }

 private:
  std::array<std::array<float, 2>, kLowPassSections> states_{};
};

}  // namespace chladni
