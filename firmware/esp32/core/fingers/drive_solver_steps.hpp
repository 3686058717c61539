// What each slice of a solver does, for any kind of real number.
#pragma once

#include "core/fingers/drive_solver.hpp"

namespace chladni::fingers {

template <typename Real>
bool DriveSolver<Real>::begin() {
  drives_ = {};
  finger_ = 0;
  slice_ = Slice::kDone;
  const bool is_set = set_.count >= 1 && set_.count <= kMostFingers && set_.channels >= 1 &&
                      set_.channels <= kMostChannels;
  if (is_set) slice_ = Slice::kScale;
  return is_set;
}

template <typename Real>
bool DriveSolver<Real>::step() {
  switch (slice_) {
    case Slice::kScale: scale(); break;
    case Slice::kPush:
      push_back_.find(set_);
      slice_ = Slice::kLoad;
      break;
    case Slice::kLoad:
      push_back_.load(set_, finger_);
      advance(Slice::kTake);
      break;
    case Slice::kTake:
      silence_.take(set_, finger_);
      advance(Slice::kFirst);
      break;
    case Slice::kFirst:
      first();
      choice_.begin();
      advance(Slice::kChoose);
      break;
    case Slice::kChoose:
      if (!is_open(finger_) || !choice_.step(set_, finger_, own_, silence_, drives_[finger_])) {
        choice_.begin();
        advance(Slice::kDone);
        if (is_done()) finish();
      }
      break;
    case Slice::kDone: break;
  }
  return !is_done();
}

// Counted in what each slice does, rounded up; the test of what drives cost holds them against it.
// A factor that rounding spoils is made again, at most twice, which is left out.
template <typename Real>
uint32_t DriveSolver<Real>::next_products() const {
  const uint32_t n = set_.count, c = set_.channels, points = kPoints * (n - 1);
  const uint32_t solve = 2 * c * c * c / 3 + 6 * c * c + 30 * n * (c + 1) + 60;
  switch (slice_) {
    case Slice::kScale: return 2 * kPoints * n * c + c * (c + 1) + 30 * n;
    case Slice::kPush: return 4 * n * c * c + (12 * n + 6 * n * n) * c + 8 * n * n * n;
    case Slice::kLoad: return 8 * points * c + 6 * c;
    case Slice::kTake: return 2 * kPoints * c * c + 24 * c;
    case Slice::kFirst: return set_.fingers[finger_].level_n > Real{} ? solve : 0;
    // The last λ is the smallest, and is refined; with the last finger all is scaled back.
    case Slice::kChoose: {
      const uint32_t refined = solve + 4 * c * c + 8 * points * c + 8 * c;
      return (is_open(finger_) ? refined : 0) + 20 * n;
    }
    case Slice::kDone: break;
  }
  return 0;
}

template <typename Real>
void DriveSolver<Real>::advance(Slice after) {
  if (++finger_ < set_.count) return;
  finger_ = 0;
  slice_ = after;
}

// The largest component of all responses, of which those that are no use become 0.
template <typename Real>
Real DriveSolver<Real>::largest_response() {
  Real most{};
  const auto take = [&most](Real& value) {
    if (!is_within(value, Real(kMost))) value = Real{};
    const Real size = magnitude(value);
    if (size > most) most = size;
  };
  for (uint32_t j = 0; j < set_.count; ++j) {
    for (PerChannel<Real>& point : set_.fingers[j].points) {
      for (uint32_t k = 0; k < set_.channels; ++k) {
        take(point[k].re);
        take(point[k].im);
      }
    }
  }
  return most;
}

// Responses come in any unit: with the largest about 1, squares of all others are numbers.
// Stiffness and coupling go the other way, so that what is pushed stays the same.
template <typename Real>
void DriveSolver<Real>::scale() {
  const Real most = largest_response();
  scale_ = Real(1.0F);
  if (most > Real(kLeast)) {
    while (most * scale_ > Real(1.0F)) scale_ = scale_ * Real(1.0F / 16.0F);
    while (most * scale_ < Real(1.0F / 16.0F)) scale_ = scale_ * Real(16.0F);
  }
  const auto rescale = [](Complex<Real>& value, Real by) {
    value = value * by;
    if (!is_within(value.re, Real(kMost)) || !is_within(value.im, Real(kMost))) value = {};
  };
  for (uint32_t j = 0; j < set_.count; ++j) {
    Finger<Real>& finger = set_.fingers[j];
    for (PerChannel<Real>& point : finger.points) {
      for (uint32_t k = 0; k < set_.channels; ++k) point[k] = point[k] * scale_;
    }
    rescale(finger.own, scale_);
    if (!is_within(finger.level_n, Real(kMost))) finger.level_n = Real{};
    finger.threshold_m =
        is_within(finger.threshold_m, Real(kMost)) ? finger.threshold_m * scale_ : Real{};
  }
  const Real back = Real(1.0F) / scale_;
  rescale(set_.stiffness, back);
  const bool is_free = !(squared(set_.stiffness) > Real{});
  slice_ = is_free ? Slice::kTake : Slice::kPush;
  if (is_free) return;
  for (uint32_t k = 0; k < set_.channels * (set_.channels + 1) / 2; ++k) {
    rescale(set_.coupling[k], back);
  }
}

template <typename Real>
void DriveSolver<Real>::first() {
  const Finger<Real>& finger = set_.fingers[finger_];
  own_[finger_] = Real{};
  if (!(finger.level_n > Real{})) return;
  silence_.begin(set_, finger_);
  const bool is_given = finger.regularisation > Real{};
  const Real regularisation = is_given ? finger.regularisation : Real(kRegularisation);
  silence_.solve(set_, regularisation, drives_[finger_]);
  own_[finger_] = drives_[finger_].shares[finger_] * finger.level_n;
}

template <typename Real>
bool DriveSolver<Real>::is_open(uint32_t finger) const {
  const Finger<Real>& one = set_.fingers[finger];
  return set_.count > 1 && one.level_n > Real{} && !(one.regularisation > Real{});
}

// Displacements in the unit that came.
template <typename Real>
void DriveSolver<Real>::finish() {
  const Real back = Real(1.0F) / scale_;
  for (uint32_t k = 0; k < set_.count; ++k) {
    FingerDrive<Real>& drive = drives_[k];
    for (uint32_t j = 0; j < set_.count; ++j) {
      drive.means[j] = drive.means[j] * back;
      drive.shares[j] = drive.shares[j] * back;
    }
  }
}

}  // namespace chladni::fingers
