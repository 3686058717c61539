// What fingers do to the plate they press on. Finger j pushes back with Z times its displacement
// u_j, and so what the channels do at its points and at the others' is
//
//     u = (1 + Z g)⁻¹ h̄,   h′(p) = h(p) − Σ_j g(p, j) Z u_j,
//
// with g(p, j) = h(p)ᵀ M h̄_j from finger j to another's points, and j's own compliance at its own
// (tables/chladni/drives/fingers/coupling.py).
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/finger_set.hpp"
#include "core/fingers/real.hpp"

namespace chladni::fingers {

// Σ_p w_p h(p): over the disc.
template <typename Real>
void find_mean(const std::array<PerChannel<Real>, kPoints>& points, uint32_t channels,
               PerChannel<Real>& mean) {
  for (uint32_t k = 0; k < channels; ++k) {
    Complex<Real> ring{};
    for (uint32_t p = 1; p < kPoints; ++p) ring = ring + points[p][k];
    mean[k] = points[0][k] * Real(kCentreWeight) + ring * Real(kRingWeight);
  }
}

// False if one is no number, too.
template <typename Real>
bool is_usable(const PerChannel<Real>& values, uint32_t channels, Real most) {
  for (uint32_t k = 0; k < channels; ++k) {
    if (!is_within(values[k].re, most) || !is_within(values[k].im, most)) return false;
  }
  return true;
}

template <typename Real>
class PushBack {
 public:
  // Finds M h̄_j and Z u_j of all fingers. Where the equations have no answer nothing is pushed.
  void find(const FingerSet<Real>& set) {
    for (uint32_t j = 0; j < set.count; ++j) {
      find_mean(set.fingers[j].points, set.channels, pushed_[j]);
      couple(set, pushed_[j], coupled_[j]);
    }
    for (uint32_t i = 0; i < set.count; ++i) {
      for (uint32_t j = 0; j < i; ++j) {
        const Complex<Real> g = set.stiffness * product(pushed_[i], coupled_[j], set.channels);
        matrix_[i][j] = matrix_[j][i] = g;
      }
      matrix_[i][i] = set.stiffness * set.fingers[i].own;
      matrix_[i][i].re = matrix_[i][i].re + Real(1.0F);
    }
    is_found_ = eliminate(set.count, set.channels);
    for (uint32_t j = 0; j < set.count; ++j) {
      for (uint32_t k = 0; k < set.channels; ++k) pushed_[j][k] = set.stiffness * pushed_[j][k];
    }
  }

  // h′ in place of h, at a finger's points; h where h′ is no number.
  void load(FingerSet<Real>& set, uint32_t finger) const {
    if (!is_found_) return;
    PerChannel<Real> by_own{};
    for (uint32_t k = 0; k < set.channels; ++k) {
      by_own[k] = set.fingers[finger].own * pushed_[finger][k];
    }
    for (PerChannel<Real>& point : set.fingers[finger].points) {
      PerChannel<Real> loaded{};
      for (uint32_t k = 0; k < set.channels; ++k) loaded[k] = point[k] - by_own[k];
      for (uint32_t j = 0; j < set.count; ++j) {
        if (j == finger) continue;
        const Complex<Real> g = product(point, coupled_[j], set.channels);
        for (uint32_t k = 0; k < set.channels; ++k) subtract_product(loaded[k], g, pushed_[j][k]);
      }
      if (is_usable(loaded, set.channels, Real(kMostLoaded))) point = loaded;
    }
  }

 private:
  // Of responses that are at most 1: a finger does not make a plate move so much more.
  static constexpr float kMostLoaded = 1e6F;

  static Complex<Real> product(const PerChannel<Real>& a, const PerChannel<Real>& b,
                               uint32_t channels) {
    Complex<Real> sum{};
    for (uint32_t k = 0; k < channels; ++k) add_product(sum, a[k], b[k]);
    return sum;
  }

  // M h̄, M having its upper triangle alone.
  static void couple(const FingerSet<Real>& set, const PerChannel<Real>& mean,
                     PerChannel<Real>& coupled) {
    coupled = {};
    uint32_t at = 0;
    for (uint32_t row = 0; row < set.channels; ++row) {
      add_product(coupled[row], set.coupling[at++], mean[row]);
      for (uint32_t column = row + 1; column < set.channels; ++column, ++at) {
        add_product(coupled[row], set.coupling[at], mean[column]);
        add_product(coupled[column], set.coupling[at], mean[row]);
      }
    }
  }

  // u in place of h̄ in `pushed_`, by Gauss with the largest pivots.
  bool eliminate(uint32_t count, uint32_t channels) {
    for (uint32_t k = 0; k < count; ++k) {
      uint32_t best = k;
      for (uint32_t row = k + 1; row < count; ++row) {
        if (squared(matrix_[row][k]) > squared(matrix_[best][k])) best = row;
      }
      swap_rows(k, best);
      const Real size = squared(matrix_[k][k]);
      if (!(size > Real(1e-12F))) return false;
      const Complex<Real> inverse = conj(matrix_[k][k]) * (Real(1.0F) / size);
      for (uint32_t column = k; column < count; ++column) {
        matrix_[k][column] = matrix_[k][column] * inverse;
      }
      for (uint32_t c = 0; c < channels; ++c) pushed_[k][c] = pushed_[k][c] * inverse;
      for (uint32_t row = 0; row < count; ++row) {
        if (row != k) take_out(row, k, count, channels);
      }
    }
    return true;
  }

  void swap_rows(uint32_t one, uint32_t other) {
    if (one == other) return;
    const auto row = matrix_[one];
    matrix_[one] = matrix_[other];
    matrix_[other] = row;
    const auto values = pushed_[one];
    pushed_[one] = pushed_[other];
    pushed_[other] = values;
  }

  void take_out(uint32_t row, uint32_t pivot, uint32_t count, uint32_t channels) {
    const Complex<Real> share = matrix_[row][pivot];
    for (uint32_t column = pivot + 1; column < count; ++column) {
      subtract_product(matrix_[row][column], share, matrix_[pivot][column]);
    }
    for (uint32_t c = 0; c < channels; ++c) {
      subtract_product(pushed_[row][c], share, pushed_[pivot][c]);
    }
  }

  std::array<PerChannel<Real>, kMostFingers> coupled_{};
  std::array<PerChannel<Real>, kMostFingers> pushed_{};
  std::array<std::array<Complex<Real>, kMostFingers>, kMostFingers> matrix_{};
  bool is_found_ = false;
};

}  // namespace chladni::fingers
