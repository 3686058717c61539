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

  [[gnu::always_inline]] int32_t rounded(RoundingErrors& errors, int32_t wanted) const {
    // In an order that needs few registers.
    int32_t fed = wanted - errors.older;
    const int32_t last = errors.last;
    errors.older = last;
    fed += 2 * last;
    errors.last = fed & mask;
    return fed >> fraction_bits;
  }
};

// A bridge between its pins and its coil, in duty steps.
struct Bridge {
  int32_t lost;        // of each pulse
  int32_t max_duty;    // what is lost included
  int32_t least_duty;  // the same, negative
  int32_t least_kept;  // no shorter duty, of the other sign, may stand before one

  // What is lost is given back. A sign changes at once and a duty when the carrier period ends: a
  // long pulse first ends, in a sample of 0. Each sign has its own way through, since that takes
  // the fewest instructions.
  [[gnu::always_inline]] int32_t next(int32_t rounded, int32_t before) const {
    if (rounded < 0) {
      if (is_rare(-before < least_kept)) return 0;
      const int32_t duty = rounded - lost;
      return duty < least_duty ? least_duty : duty;
    }
    if (rounded == 0 || is_rare(before < least_kept)) return 0;
    const int32_t duty = rounded + lost;
    return duty > max_duty ? max_duty : duty;
  }

  [[gnu::always_inline]] static bool is_rare(bool condition) {
    return __builtin_expect(static_cast<long>(condition), 0L) != 0L;
  }
};

}  // namespace chladni
