// The level at which limits allow a drive, reckoned before it plays.
#include "core/synthesis/synthesis.hpp"

namespace chladni {

namespace {

// The largest mean square of the duty over the supply's window, 15 bits, of a wave of this
// amplitude upon this bias. The window may take in the crest of one period more than its trough:
// half a period's area of the wave, and of its square about that square's mean. It may do so twice,
// at the end of one touch and at the beginning of the next.
uint32_t largest_square_q15(Waveform waveform, uint32_t amplitude_q15, uint32_t bias_q15,
                            uint32_t period_q12) {
  struct Form {
    uint32_t square_q8, area_q8, square_area_q8;  // of a wave and of a period of 1, rounded up
  };
  constexpr Form kSine{128, 82, 21}, kSquare{256, 128, 0}, kTriangle{86, 64, 33};
  const bool is_sine = waveform == Waveform::kSine, is_square = waveform == Waveform::kSquare;
  const Form form = is_sine ? kSine : (is_square ? kSquare : kTriangle);
  const uint32_t own = amplitude_q15 * amplitude_q15 >> 15;
  const uint32_t both = bias_q15 * amplitude_q15 >> 15;
  const uint32_t mean = (bias_q15 * bias_q15 >> 15) + (own * form.square_q8 >> 8) + 2U;
  const uint32_t area = (2U * both * form.area_q8 + own * form.square_area_q8) >> 8;
  const uint32_t crest = bias_q15 + amplitude_q15;
  const uint32_t most = (crest * crest >> 15) + 1U, swing = (area + 1U) * period_q12 >> 11;
  return mean + swing < most ? mean + swing : most;
}

}  // namespace

// The ceiling of every duty; the timer's own is a step below a duty of 1.
uint32_t Synthesis::max_duty_steps() const {
  const uint32_t most_q15 = settings_.limits.max_duty_q15;
  return ((most_q15 << settings_.pwm_bits) >> 15) - (most_q15 == 32768U ? 1U : 0U);
}

uint32_t Synthesis::amplitude_steps(uint32_t size_q15, uint32_t level_q15) const {
  const uint32_t share = (size_q15 * level_q15) >> 15, full = kOneQ15;
  return ((share < full ? share : full) * span_steps() >> 15) + 1U;
}

uint32_t Synthesis::delivered_ma(const Sizes& sizes, uint32_t level_q15, Waveform waveform) const {
  const uint32_t to_q15 = 15U - settings_.pwm_bits;
  const uint32_t rest = kBiasMarginSteps + settings_.limits.min_on_steps;
  uint32_t sum = 0;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    if (sizes[k] == 0) continue;
    const uint32_t steps = amplitude_steps(sizes[k], level_q15) + settings_.lost_steps;
    const uint32_t bias = settings_.has_bridges ? 0U : steps + rest;
    const uint32_t square_q15 =
        largest_square_q15(waveform, steps << to_q15, bias << to_q15, period_q12_);
    sum += square_q15 * settings_.limits.full_current_ma[k];
  }
  return (sum >> 15) + 1U;
}

uint32_t Synthesis::fitting_level(const Sizes& sizes, uint32_t level_q15, Waveform waveform) {
  const OutputLimits& limits = settings_.limits;
  uint32_t largest = 0;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    const uint32_t steps = amplitude_steps(sizes[k], level_q15);
    if (steps > largest) largest = steps;
  }
  uint32_t level = level_q15;
  const uint32_t max_duty = max_duty_steps();
  // Rounding needs room above a wave, and below a switch's.
  const bool has_bridges = settings_.has_bridges;
  const uint32_t taken = has_bridges ? kBiasMarginSteps + settings_.lost_steps
                                     : 2U * kBiasMarginSteps + limits.min_on_steps;
  const uint32_t swing = max_duty > taken ? max_duty - taken : 0U;
  const uint32_t peak_room = has_bridges ? swing : swing / 2U;
  if (largest > peak_room) level = share_of(level_q15, peak_room, largest);
  const uint32_t most_ma = reckoned_limit(limits.supply_ma);
  if (limits.supply_ma > 0 && delivered_ma(sizes, level, waveform) > most_ma) {
    // Bit by bit: the largest level that the supply allows.
    uint32_t fitting = 0;
    for (uint32_t bit = 1U << 14; bit != 0; bit >>= 1) {
      const uint32_t trial = fitting | bit;
      if (trial > level || delivered_ma(sizes, trial, waveform) > most_ma) continue;
      fitting = trial;
    }
    level = fitting;
  }
  if (level < level_q15) ++limited_;
  return level;
}

}  // namespace chladni
