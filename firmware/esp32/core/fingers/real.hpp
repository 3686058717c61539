// What the arithmetic needs of real numbers where there is neither a C library nor an operating
// system: roots, and which values may enter.
#pragma once

#include <cstdint>

namespace chladni::fingers {

// Single precision squares and divides what lies between these without overflow, in scales that no
// plate comes near: responses are 1e-7 to 1e-3 m/N.
constexpr float kMost = 1e18F;
constexpr float kLeast = 1e-18F;

// 1/√x of a positive x: a first guess by halving the exponent (Lomont, "Fast inverse square root",
// 2003; 3.4 % off), and three of Newton's steps, the last of which leaves rounding alone, 1e-7.
// The chip's compiler calls a library for roots, and for divisions.
inline float inverse_root(float x) {
  uint32_t bits = 0;
  static_assert(sizeof bits == sizeof x);
  __builtin_memcpy(&bits, &x, sizeof bits);
  bits = 0x5f375a86U - (bits >> 1U);
  float y = 0.0F;
  __builtin_memcpy(&y, &bits, sizeof y);
  for (uint32_t k = 0; k < 3; ++k) y = y * (1.5F - 0.5F * x * y * y);
  return y;
}

// 0 of what is not above the least positive normal number.
template <typename Real>
Real root(Real x) {
  return x > Real(1.2e-38F) ? x * inverse_root(x) : Real{};
}

template <typename Real>
Real magnitude(Real x) {
  return x < Real{} ? -x : x;
}

// False of no number, too.
template <typename Real>
bool is_within(Real x, Real most) {
  return x > -most && x < most;
}

}  // namespace chladni::fingers
