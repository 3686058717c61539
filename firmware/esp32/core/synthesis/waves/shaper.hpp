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

// A bridge between its pins and its coil, in duty steps. What is wanted is mirrored into the way
// that the sign pin drives the coil (`mirror` is 0, or -1 if the pin is high), where it is hardly
// ever negative: most samples need not look for a sign. So is what rounding lost; while mirrored it
// is kept a step lower, so that all duties are rounded up, and a turn leaves no trace.
struct Bridge {
  uint32_t fraction_bits;
  int32_t whole;       // all bits but the fraction's
  int32_t first;       // the duty of one step: what is lost of each pulse is given back
  int32_t most;        // steps above the first
  int32_t least_kept;  // no longer duty may stand before one of the other sign

  // Errors are kept from -1 to 0 of a step, so that 0 alone lies just below a first step.
  // Returns the steps above the first.
  [[gnu::always_inline]] int32_t above_first(RoundingErrors& errors, int32_t mirror,
                                             int32_t wanted) const {
    int32_t fed = (wanted ^ mirror) - errors.older;
    const int32_t last = errors.last;
    errors.older = last;
    fed += 2 * last;
    errors.last = fed | whole;
    return fed >> fraction_bits;
  }
  [[gnu::always_inline]] bool is_plain(int32_t above) const {
    return static_cast<uint32_t>(above) <= static_cast<uint32_t>(most);
  }

  // The duty where that is neither plain nor 0: too large, or of the other sign. A sign changes at
  // once and a duty when the carrier period ends: a long pulse `before` first ends, in a sample of
  // 0.
  [[gnu::always_inline]] int32_t turned(RoundingErrors& errors, int32_t& mirror, int32_t before,
                                        int32_t above) const {
    if (above > most) return first + most;
    if (before > least_kept) return 0;
    mirror = ~mirror;
    errors = {whole - errors.last, whole - errors.older};
    const int32_t other = -above - 2;
    return first + (other > most ? most : other);
  }
};

}  // namespace chladni
