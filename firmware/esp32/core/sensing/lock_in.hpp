// Sums of what a converter reads, by a known phase; the host divides them.
#pragma once

#include <cstdint>

#include "core/synthesis/waves/sine.hpp"

namespace chladni {

class LockIn {
 public:
  void clear() { *this = LockIn{}; }
  // Two values of 12 bits, from 2048 each; `phase` is the playing coil's, whose duty goes with its
  // cosine.
  void add(int32_t value, uint32_t phase) {
    const SineCosine wave = sine_cosine(phase);
    in_phase_ += value * wave.cosine_q15;
    quadrature_ -= value * wave.sine_q15;
    sum_ += value;
    squares_ += static_cast<uint32_t>(value * value);
    ++count_;
  }

  uint32_t count() const { return count_; }
  // Of the largest count there is, so that none overflows (docs/link-protocol.md).
  int32_t in_phase_q5() const { return static_cast<int32_t>(in_phase_ >> 10); }
  int32_t quadrature_q5() const { return static_cast<int32_t>(quadrature_ >> 10); }
  int32_t sum() const { return sum_; }
  uint32_t squares_by_256() const { return static_cast<uint32_t>(squares_ >> 8); }

 private:
  int64_t in_phase_ = 0;
  int64_t quadrature_ = 0;
  int32_t sum_ = 0;
  uint64_t squares_ = 0;
  uint32_t count_ = 0;
};

}  // namespace chladni
