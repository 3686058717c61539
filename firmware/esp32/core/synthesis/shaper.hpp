// Rounds duties to whole steps so that the rounding noise lies above the band a finger feels.
#pragma once

#include <cstdint>

namespace chladni {

// What a channel's last two samples lost by rounding, from 0 to a whole step.
struct RoundingErrors {
  int32_t last;
  int32_t older;
};

// Rounds down and feeds both errors back: the duty is what was wanted less the second difference of
// the error, and any constant part of it cancels.
struct Shaper {
  uint32_t fraction_bits;
  int32_t mask;  // of the fraction
  int32_t max_duty;

  [[gnu::always_inline]] uint32_t shape(RoundingErrors& errors, int32_t wanted) const {
    const int32_t duty = rounded(errors, wanted);
    // What is cut off is not fed back: it could only grow.
    if (static_cast<uint32_t>(duty) > static_cast<uint32_t>(max_duty)) {
      return duty < 0 ? 0U : static_cast<uint32_t>(max_duty);
    }
    return static_cast<uint32_t>(duty);
  }

  // The same of a bridge's duty, which may be negative.
  [[gnu::always_inline]] int32_t shape_signed(RoundingErrors& errors, int32_t wanted) const {
    const int32_t duty = rounded(errors, wanted);
    if (static_cast<uint32_t>(duty + max_duty) > 2U * static_cast<uint32_t>(max_duty)) {
      return duty < 0 ? -max_duty : max_duty;
    }
    return duty;
  }

  [[gnu::always_inline]] int32_t rounded(RoundingErrors& errors, int32_t wanted) const {
    const int32_t fed = wanted + 2 * errors.last - errors.older;
    errors.older = errors.last;
    errors.last = fed & mask;
    return fed >> fraction_bits;
  }
};

// A bridge between its pins and its coil, in duty steps.
struct Bridge {
  int32_t lost;         // of each pulse
  int32_t most_turned;  // the longest pulse that a sign may follow at once

  // What is lost is given back. A sign changes at once and a duty when the carrier period ends: a
  // long pulse first ends, in a sample of 0.
  [[gnu::always_inline]] int32_t next(int32_t wanted, int32_t before) const {
    const int32_t own = wanted < 0 ? -lost : lost;
    const int32_t duty = wanted == 0 ? 0 : wanted + own;
    const bool does_turn = (duty < 0) != (before < 0);
    return does_turn && (before < 0 ? -before : before) > most_turned ? 0 : duty;
  }
};

}  // namespace chladni
