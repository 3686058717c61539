// What the drives of several fingers are found from, and what is found: plain numbers, whatever
// table or model they come from.
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/complex.hpp"
#include "core/generated/table_format.hpp"

namespace chladni::fingers {

// That a panel lists; those without a voice have a level of 0.
constexpr uint32_t kMostFingers = 10;
constexpr uint32_t kMostChannels = table_format::kMaxActuators;
// The middle of the fingertip, then a ring of six at 5 mm, 60° from one to the next, the first
// along x (tables/chladni/drives/fingers/silence.py has why).
constexpr uint32_t kRingPoints = 6;
constexpr uint32_t kPoints = 1 + kRingPoints;
// In a disc's mean.
constexpr float kCentreWeight = 0.28F;
constexpr float kRingWeight = 0.12F;

// Of each channel: its displacement per newton (m/N), or its part in a drive.
template <typename Real>
using PerChannel = std::array<Complex<Real>, kMostChannels>;

// A fingertip on the plate. A value that is no number, or an infinite one, counts as 0.
template <typename Real>
struct Finger {
  std::array<PerChannel<Real>, kPoints> points{};  // what each channel does at its points, m/N
  Complex<Real> own{};  // its mean displacement by a newton of its own, m/N
  Real level_n{};       // what the largest coil of its drive will be given, N; 0: it plays nothing
  Real threshold_m{};   // RMS over its disc, peak in time, from which it feels another's signal
  Real regularisation{};  // λ over the mean square of a point's responses; 0: chosen (choice.hpp)
  bool is_real{};         // its drive has no imaginary part
};

// All fingers that are on the plate. With a stiffness of 0 the plate is free: neither `own` nor
// `coupling` is read.
template <typename Real>
struct FingerSet {
  uint32_t channels{};
  uint32_t count{};  // of fingers
  std::array<Finger<Real>, kMostFingers> fingers{};
  // M, N/m, symmetric: the upper triangle, row by row, `channels` in the first.
  std::array<Complex<Real>, kMostChannels*(kMostChannels + 1) / 2> coupling{};
  Complex<Real> stiffness{};  // force over displacement of each finger, N/m
};

// The drive of a finger, and what the plate that is known says of it. Displacements are of a drive
// whose largest coil has 1 N: m/N.
template <typename Real>
struct FingerDrive {
  PerChannel<Real> gains{};                         // the largest absolute value is 1, or all are 0
  std::array<Complex<Real>, kMostFingers> means{};  // over each finger's disc
  std::array<Real, kMostFingers> shares{};          // RMS over each finger's points
  // Its own mean displacement over Σ|h̄|, the most that coils of 1 N each can do: 0 to 1.
  Real of_loudest{};
  Real regularisation{};  // as it was used; kLoudest (silence.hpp): whatever the others feel
};

}  // namespace chladni::fingers
