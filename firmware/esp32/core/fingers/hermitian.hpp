// A Hermitian matrix of the channels' size: sums of points' products, and equations solved by
// Cholesky's factors (Golub and Van Loan, Matrix Computations, 4.2). Only the lower half is there.
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/finger_set.hpp"
#include "core/fingers/real.hpp"

namespace chladni::fingers {

template <typename Real>
class Hermitian {
 public:
  // Σ over a finger's points of h* hᵀ: entry (a, b) is Σ conj(h_a) h_b.
  void set_gram(const std::array<PerChannel<Real>, kPoints>& points, uint32_t channels) {
    for (uint32_t a = 0; a < channels; ++a) {
      for (uint32_t b = 0; b < a; ++b) {
        Complex<Real> sum{};
        for (const PerChannel<Real>& h : points) add_product(sum, conj(h[a]), h[b]);
        at(a, b) = sum;
      }
      Real sum{};
      for (const PerChannel<Real>& h : points) sum = sum + squared(h[a]);
      at(a, a) = {sum, Real{}};
    }
  }

  void add(const Hermitian& other, uint32_t channels) {
    for (uint32_t k = 0; k < channels * (channels + 1) / 2; ++k) {
      lower_[k] = lower_[k] + other.lower_[k];
    }
  }

  void drop_imaginary(uint32_t channels) {
    for (uint32_t k = 0; k < channels * (channels + 1) / 2; ++k) lower_[k].im = Real{};
  }

  Real trace(uint32_t channels) const {
    Real sum{};
    for (uint32_t a = 0; a < channels; ++a) sum = sum + at(a, a).re;
    return sum;
  }

  // The factor of `gram` + λ I, with the diagonal's reciprocals. False if rounding has eaten λ: no
  // pivot of the exact sum is less than λ.
  bool factorise(const Hermitian& gram, Real lambda, uint32_t channels) {
    const Real least = lambda * Real(0.25F);
    for (uint32_t a = 0; a < channels; ++a) {
      Real pivot = gram.at(a, a).re + lambda;
      for (uint32_t b = 0; b < a; ++b) {
        Complex<Real> sum = gram.at(a, b);
        for (uint32_t k = 0; k < b; ++k) subtract_product(sum, at(a, k), conj(at(b, k)));
        at(a, b) = sum * at(b, b).re;
        pivot = pivot - squared(at(a, b));
      }
      if (!(pivot > least)) return false;
      at(a, a) = {inverse_root(pivot), Real{}};
    }
    return true;
  }

  // x of (G + λ I) x = b in place of b, once this is its factor.
  void solve(PerChannel<Real>& x, uint32_t channels) const {
    for (uint32_t a = 0; a < channels; ++a) {
      for (uint32_t k = 0; k < a; ++k) subtract_product(x[a], at(a, k), x[k]);
      x[a] = x[a] * at(a, a).re;
    }
    for (uint32_t a = channels; a-- > 0;) {
      for (uint32_t k = a + 1; k < channels; ++k) subtract_product(x[a], conj(at(k, a)), x[k]);
      x[a] = x[a] * at(a, a).re;
    }
  }

 private:
  static constexpr uint32_t place(uint32_t row, uint32_t column) {
    return row * (row + 1) / 2 + column;
  }
  Complex<Real>& at(uint32_t row, uint32_t column) { return lower_[place(row, column)]; }
  const Complex<Real>& at(uint32_t row, uint32_t column) const {
    return lower_[place(row, column)];
  }

  std::array<Complex<Real>, kMostChannels*(kMostChannels + 1) / 2> lower_{};
};

}  // namespace chladni::fingers
