// The drives of all fingers on a plate, in slices that the main loop has time for.
//
//     solver.set() = …;            // fingers, their responses, coupling
//     solver.begin();
//     while (solver.step()) { }    // one slice a turn
//     solver.drive(0).gains …
//
// Everything is in single precision: for the main loop, never for the sample interrupt. Nothing
// that is given makes a drive that is no number.
#pragma once

#include "core/fingers/choice.hpp"
#include "core/fingers/finger_set.hpp"
#include "core/fingers/push_back.hpp"
#include "core/fingers/silence.hpp"

namespace chladni::fingers {

template <typename Real>
class DriveSolver {
 public:
  // What is to be solved, to be filled before `begin`; `step` overwrites it.
  FingerSet<Real>& set() { return set_; }

  // False, and no drives, if the set has no finger, too many, no channel or too many.
  bool begin();
  // Does a slice; false when all drives are found. A finger of level 0 gets none, all its gains are
  // 0.
  bool step();

  // The most that the next step multiplies.
  uint32_t next_products() const;

  bool is_done() const { return slice_ == Slice::kDone; }
  // Of a finger of the set, once `step` has said that all are found.
  const FingerDrive<Real>& drive(uint32_t finger) const { return drives_[finger]; }

 private:
  enum class Slice : uint8_t { kScale, kPush, kLoad, kTake, kFirst, kChoose, kDone };

  void scale();
  Real largest_response();
  void first();
  // Whether a finger's λ is chosen, and has something to be chosen for.
  bool is_open(uint32_t finger) const;
  // Goes on to the next finger, or to the slice that follows the last one.
  void advance(Slice after);
  void finish();

  FingerSet<Real> set_{};
  std::array<FingerDrive<Real>, kMostFingers> drives_{};
  PushBack<Real> push_back_{};
  Silence<Real> silence_{};
  Choice<Real> choice_{};
  OwnShares<Real> own_{};
  Real scale_{};  // of responses, for the largest to be about 1
  Slice slice_ = Slice::kDone;
  uint32_t finger_ = 0;
};

extern template class DriveSolver<float>;

}  // namespace chladni::fingers
