// The drive of one finger that leaves the others still,
//
//     d = λ (Hᴴ H + λ I)⁻¹ h̄*,
//
// with all points of the other fingers as rows of H (tables/chladni/drives/fingers/silence.py has
// where it comes from). Each finger's own Hᴴ H is summed once and kept, and the others' are added:
// taking one's own out of the sum of all would leave that sum's rounding, which is not small beside
// λ (on `prototype` -18 dB of a drive at worst, where -84 are left). One step of refinement with
// residuals from the points themselves takes out what rounding in the matrix and its factors did
// (Björck, Numerical Methods for Least Squares Problems, 2.9): errors then grow with the points'
// condition, no more with its square.
//
// Of a drive with real gains, ‖H d‖² = dᵀ Re(Hᴴ H) d, and the real part of h̄* takes its place, once
// the phase that all of it has in common is taken out (real_part.hpp).
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/finger_set.hpp"
#include "core/fingers/hermitian.hpp"
#include "core/fingers/push_back.hpp"
#include "core/fingers/real_part.hpp"

namespace chladni::fingers {

// A regularisation that leaves nothing of the others in a drive.
constexpr float kLoudest = 1e9F;

template <typename Real>
class Silence {
 public:
  // Takes up a finger's points: its matrix, mean and loudest drive.
  void take(const FingerSet<Real>& set, uint32_t finger) {
    grams_[finger].set_gram(set.fingers[finger].points, set.channels);
    PerChannel<Real>& target = targets_[finger];
    find_mean(set.fingers[finger].points, set.channels, target);
    Real most{};
    for (uint32_t k = 0; k < set.channels; ++k) {
      most = larger(most, larger(magnitude(target[k].re), magnitude(target[k].im)));
    }
    // Its largest becomes 1, for squares of a small one to be numbers.
    const Real scale = most > Real(kLeast) ? Real(1.0F) / most : Real{};
    Real sum{};
    for (uint32_t k = 0; k < set.channels; ++k) {
      target[k] = conj(target[k]) * scale;
      sum = sum + root(squared(target[k]));
    }
    if (set.fingers[finger].is_real) keep_real_part(target.data(), set.channels);
    loudest_[finger] = sum * most;
  }

  // Sets about a finger: adds up the others.
  void begin(const FingerSet<Real>& set, uint32_t finger) {
    finger_ = finger;
    bool is_first = true;
    for (uint32_t other = 0; other < set.count; ++other) {
      if (other == finger) continue;
      if (is_first) {
        others_ = grams_[other];
      } else {
        others_.add(grams_[other], set.channels);
      }
      is_first = false;
    }
    is_real_ = set.fingers[finger].is_real;
    if (is_real_) others_.drop_imaginary(set.channels);
    const Real points = Real(static_cast<float>((set.count - 1) * kPoints));
    mean_square_ = is_first ? Real{} : others_.trace(set.channels) / points;
  }

  // The drive with so much regularisation, or with more where single precision needs it.
  void solve(const FingerSet<Real>& set, Real regularisation, FingerDrive<Real>& drive) {
    drive = {};
    drive.regularisation = find(set, regularisation, drive.gains);
    set_largest_to_one(drive.gains, set.channels);
    for (uint32_t j = 0; j < set.count; ++j) predict(set.fingers[j], set.channels, j, drive);
    const Real own = root(squared(drive.means[finger_]));
    const Real loudest = loudest_[finger_];
    // A finger so stiff that nothing moves it has rounding alone for a mean.
    drive.of_loudest = own < loudest ? own / loudest : Real(loudest > Real{} ? 1.0F : 0.0F);
  }

 private:
  // Below it the others feel nothing at all, of responses that are at most 1: 300 dB.
  static constexpr float kLeastSquare = 1e-30F;
  // Larger λ have no need of refinement.
  static constexpr float kRefined = 5e-4F;
  static constexpr uint32_t kMostTries = 3;
  // What single precision rounds away: a smaller λ is none.
  static constexpr float kLeastRegularisation = 1e-7F;
  // Of targets whose largest component is 1: no drive that is right comes near it.
  static constexpr float kMostGain = 1e3F;

  static Real larger(Real a, Real b) { return a > b ? a : b; }

  Real find(const FingerSet<Real>& set, Real regularisation, PerChannel<Real>& gains) {
    regularisation = larger(regularisation, Real(kLeastRegularisation));
    if (mean_square_ > Real(kLeastSquare) && regularisation < Real(kLoudest)) {
      for (uint32_t k = 0; k < kMostTries; ++k) {
        if (k > 0) regularisation = regularisation * Real(10.0F);
        const Real lambda = regularisation * mean_square_;
        if (!factor_.factorise(others_, lambda, set.channels)) continue;
        for (uint32_t c = 0; c < set.channels; ++c) gains[c] = targets_[finger_][c] * lambda;
        factor_.solve(gains, set.channels);
        if (regularisation < Real(kRefined)) refine(set, lambda, gains);
        if (is_usable(gains, set.channels, Real(kMostGain))) return regularisation;
      }
    }
    gains = targets_[finger_];
    return Real(kLoudest);
  }

  // d += (Hᴴ H + λ I)⁻¹ (λ (h̄* − d) − Hᴴ (H d)).
  void refine(const FingerSet<Real>& set, Real lambda, PerChannel<Real>& gains) const {
    PerChannel<Real> rest{};
    for (uint32_t c = 0; c < set.channels; ++c) {
      rest[c] = (targets_[finger_][c] - gains[c]) * lambda;
    }
    for (uint32_t j = 0; j < set.count; ++j) {
      if (j == finger_) continue;
      for (const PerChannel<Real>& h : set.fingers[j].points) {
        const Complex<Real> moved = displacement(h, gains, set.channels);
        for (uint32_t c = 0; c < set.channels; ++c) subtract_product(rest[c], conj(h[c]), moved);
      }
    }
    for (uint32_t c = 0; is_real_ && c < set.channels; ++c) rest[c].im = Real{};
    factor_.solve(rest, set.channels);
    for (uint32_t c = 0; c < set.channels; ++c) gains[c] = gains[c] + rest[c];
  }

  static Complex<Real> displacement(const PerChannel<Real>& h, const PerChannel<Real>& gains,
                                    uint32_t channels) {
    Complex<Real> sum{};
    for (uint32_t c = 0; c < channels; ++c) add_product(sum, h[c], gains[c]);
    return sum;
  }

  static void set_largest_to_one(PerChannel<Real>& gains, uint32_t channels) {
    Real most{};
    for (uint32_t c = 0; c < channels; ++c) most = larger(most, squared(gains[c]));
    if (!(most > Real(kLeastSquare))) {
      gains = {};
      return;
    }
    const Real scale = inverse_root(most);
    for (uint32_t c = 0; c < channels; ++c) gains[c] = gains[c] * scale;
  }

  static void predict(const Finger<Real>& finger, uint32_t channels, uint32_t at,
                      FingerDrive<Real>& drive) {
    const Complex<Real> middle = displacement(finger.points[0], drive.gains, channels);
    Complex<Real> ring{};
    Real squares{};
    for (uint32_t p = 1; p < kPoints; ++p) {
      const Complex<Real> moved = displacement(finger.points[p], drive.gains, channels);
      ring = ring + moved;
      squares = squares + squared(moved);
    }
    drive.means[at] = middle * Real(kCentreWeight) + ring * Real(kRingWeight);
    drive.shares[at] = root(squared(middle) * Real(kCentreWeight) + squares * Real(kRingWeight));
  }

  std::array<Hermitian<Real>, kMostFingers> grams_{};
  std::array<PerChannel<Real>, kMostFingers> targets_{};
  std::array<Real, kMostFingers> loudest_{};
  Hermitian<Real> others_{};
  Hermitian<Real> factor_{};
  Real mean_square_{};
  uint32_t finger_ = 0;
  bool is_real_ = false;
};

}  // namespace chladni::fingers
