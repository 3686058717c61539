#include "core/synthesis/envelope.hpp"

#include "core/synthesis/output_limits.hpp"

namespace chladni {

void Envelope::start(const Config& config, uint32_t table_ramp_us) {
  const auto or_ramp = [table_ramp_us](uint32_t milliseconds) {
    return milliseconds > 0 ? milliseconds * 1000U : table_ramp_us;
  };
  *this = Envelope{};
  ramp_us_ = table_ramp_us;
  attack_us_ = or_ramp(config.attack_ms);
  decay_us_ = config.decay_ms * 1000U;
  release_us_ = or_ramp(config.release_ms);
  level_q15_ = config.level_q15;
  sustain_q15_ = (level_q15_ * config.sustain_q15 + 16384U) >> 15;
  if (config.sustain_q15 == 32767U) sustain_q15_ = level_q15_;
  lift_pulse_us_ = config.lift_pulse_ms * 1000U;
  lift_level_q15_ = config.lift_level_q15;
}

Line Envelope::begin(uint32_t now_us) {
  is_decaying_ = false;
  line_us_ = now_us;
  line_ramp_us_ = attack_us_;
  return {level_q15_, attack_us_};
}

bool Envelope::decays(uint32_t now_us) {
  if (is_decaying_ || sustain_q15_ == level_q15_ || now_us - line_us_ < attack_us_) return false;
  is_decaying_ = true;
  line_us_ = now_us;
  line_ramp_us_ = decay_us_ > ramp_us_ ? decay_us_ : ramp_us_;
  return true;
}

uint32_t Envelope::level_at(uint32_t now_us) const {
  const uint32_t to = is_decaying_ ? sustain_q15_ : level_q15_, passed = now_us - line_us_;
  if (passed >= line_ramp_us_) return to;
  const uint32_t from = is_decaying_ ? level_q15_ : 0U;
  return from < to ? from + share_of(to - from, passed, line_ramp_us_)
                   : from - share_of(from - to, passed, line_ramp_us_);
}

Line Envelope::current(uint32_t now_us) const {
  const uint32_t passed = now_us - line_us_;
  const uint32_t left = passed < line_ramp_us_ ? line_ramp_us_ - passed : 0U;
  return {is_decaying_ ? sustain_q15_ : level_q15_, left > ramp_us_ ? left : ramp_us_};
}

}  // namespace chladni
