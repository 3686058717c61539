// Which λ a finger's drive gets: as much silence as makes its signal unfelt elsewhere, the rest
// into level (tables/chladni/drives/fingers/choice.py has the rule and what it is measured by).
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/finger_set.hpp"
#include "core/fingers/silence.hpp"

namespace chladni::fingers {

constexpr float kRegularisation = 1e-3F;
constexpr float kStiller = 1e-4F;
constexpr std::array<float, 3> kLouder = {1e-2F, 1e-1F, kLoudest};
// 20 dB below the loudest.
constexpr float kLeastOfLoudest = 0.1F;

// Of the drives with the first λ: RMS of each finger's own, at the level that is played, m.
template <typename Real>
using OwnShares = std::array<Real, kMostFingers>;

// Chooses for one finger, a try a call.
template <typename Real>
class Choice {
 public:
  void begin() { next_ = 0; }

  // False when `drive`, which begins as that of the first λ, is the one to be played.
  bool step(const FingerSet<Real>& set, uint32_t finger, const OwnShares<Real>& own,
            Silence<Real>& silence, FingerDrive<Real>& drive) {
    if (next_ == 0) {
      if (!is_quiet(drive)) return still(set, finger, silence, drive);
      silence.begin(set, finger);
    }
    FingerDrive<Real> louder;
    silence.solve(set, Real(kLouder[next_]), louder);
    if (!is_tolerable(set, finger, own, louder)) return false;
    drive = louder;
    return is_quiet(louder) && ++next_ < kLouder.size();
  }

 private:
  static bool is_quiet(const FingerDrive<Real>& drive) {
    return drive.of_loudest < Real(kLeastOfLoudest);
  }

  static bool still(const FingerSet<Real>& set, uint32_t finger, Silence<Real>& silence,
                    FingerDrive<Real>& drive) {
    if (!is_felt(set, finger, drive)) return false;
    silence.begin(set, finger);
    FingerDrive<Real> stiller;
    silence.solve(set, Real(kStiller), stiller);
    if (!is_quiet(stiller)) drive = stiller;
    return false;
  }

  static bool is_felt(const FingerSet<Real>& set, uint32_t finger, const FingerDrive<Real>& drive) {
    for (uint32_t j = 0; j < set.count; ++j) {
      const Real share = drive.shares[j] * set.fingers[finger].level_n;
      if (j != finger && share > set.fingers[j].threshold_m) return true;
    }
    return false;
  }

  // Whether each other finger feels no more of it than of its own, or nothing if it has none.
  static bool is_tolerable(const FingerSet<Real>& set, uint32_t finger, const OwnShares<Real>& own,
                           const FingerDrive<Real>& drive) {
    for (uint32_t j = 0; j < set.count; ++j) {
      const Finger<Real>& other = set.fingers[j];
      const Real most = other.level_n > Real{} ? own[j] : other.threshold_m;
      const Real share = drive.shares[j] * set.fingers[finger].level_n;
      if (j != finger && share > most) return false;
    }
    return true;
  }

  uint32_t next_ = 0;
};

}  // namespace chladni::fingers
