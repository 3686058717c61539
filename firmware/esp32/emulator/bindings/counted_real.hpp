// A float that counts what is done with it: what finding drives costs, whatever compiler.
#pragma once

#include <cstdint>

#include "core/fingers/real.hpp"

namespace chladni::emulator {

struct OperationCounts {
  uint32_t products = 0;  // divisions too
  uint32_t sums = 0;
};

struct CountedReal {
  static inline OperationCounts counts;

  float value = 0.0F;

  CountedReal() = default;
  explicit CountedReal(float initial) : value(initial) {}

  CountedReal operator-() const { return CountedReal(-value); }
};

inline CountedReal product(float value) {
  ++CountedReal::counts.products;
  return CountedReal(value);
}
inline CountedReal sum(float value) {
  ++CountedReal::counts.sums;
  return CountedReal(value);
}

inline CountedReal operator*(CountedReal a, CountedReal b) { return product(a.value * b.value); }
inline CountedReal operator/(CountedReal a, CountedReal b) { return product(a.value / b.value); }
inline CountedReal operator+(CountedReal a, CountedReal b) { return sum(a.value + b.value); }
inline CountedReal operator-(CountedReal a, CountedReal b) { return sum(a.value - b.value); }
inline bool operator<(CountedReal a, CountedReal b) { return a.value < b.value; }
inline bool operator>(CountedReal a, CountedReal b) { return a.value > b.value; }

// Three steps of Newton's, four products and a sum each.
inline CountedReal inverse_root(CountedReal x) {
  CountedReal::counts.products += 12;
  CountedReal::counts.sums += 3;
  return CountedReal(fingers::inverse_root(x.value));
}

}  // namespace chladni::emulator
