// Finds a sine of known phase in what a converter reads.
#pragma once

#include <cstdint>

#include "core/synthesis/waves/sine.hpp"

namespace chladni {

class LockIn {
 public:
  void clear() { *this = LockIn{}; }
  // A value in steps; `phase` is the playing coil's, whose duty goes with its cosine.
  void add(int32_t value, uint32_t phase) {
    const SineCosine wave = sine_cosine(phase);
    in_phase_ += static_cast<int64_t>(value) * wave.cosine_q15;
    quadrature_ -= static_cast<int64_t>(value) * wave.sine_q15;
    sum_ += value;
    squares_ += static_cast<uint64_t>(static_cast<int64_t>(value) * value);
    ++count_;
  }

  uint32_t count() const { return count_; }
  // Amplitudes in 4096ths of a step: twice the mean product, of 15 bits.
  int32_t in_phase_q12() const { return mean(in_phase_ / 4); }
  int32_t quadrature_q12() const { return mean(quadrature_ / 4); }
  int32_t mean_q2() const { return mean(sum_ * 4); }
  uint32_t power_q4() const {
    return count_ == 0 ? 0U : static_cast<uint32_t>(squares_ * 16U / count_);
  }

 private:
  int32_t mean(int64_t sum) const {
    return count_ == 0 ? 0 : static_cast<int32_t>(sum / static_cast<int64_t>(count_));
  }

  int64_t in_phase_ = 0;
  int64_t quadrature_ = 0;
  int64_t sum_ = 0;
  uint64_t squares_ = 0;
  uint32_t count_ = 0;
};

}  // namespace chladni
