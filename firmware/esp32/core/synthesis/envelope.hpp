// How loud a touch is over time: up in the attack, down in the decay, then held until lift-up; and
// what plays after that. The synthesis ramps in straight lines, so this only says when a new line
// begins, where it ends and how long it takes.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"

namespace chladni {

struct Line {
  uint32_t level_q15;
  uint32_t ramp_us;
};

class Envelope {
 public:
  // `table_ramp_us` for every time that the configuration leaves out.
  void start(const Config& config, uint32_t table_ramp_us);

  // A touch begins now; its first line.
  Line begin(uint32_t now_us);
  // Whether the decay begins now; at most once per touch.
  bool decays(uint32_t now_us);
  // The line for a drive that changes in the middle of a touch: there in one ramp, or together with
  // the line it is on, whichever takes longer.
  Line current(uint32_t now_us) const;
  // How loud it is then, if nothing comes between: where several change over together, one may be
  // on a longer line than the others.
  uint32_t level_at(uint32_t now_us) const;
  bool is_on_a_line(uint32_t now_us) const { return now_us - line_us_ < line_ramp_us_; }
  uint32_t release_us() const { return release_us_; }

  // After lift-up the last place plays on for so long, at this line.
  uint32_t lift_pulse_us() const { return lift_pulse_us_; }
  Line lift_line() const { return {lift_level_q15_, ramp_us_}; }

 private:
  uint32_t ramp_us_ = 0;
  uint32_t attack_us_ = 0;
  uint32_t decay_us_ = 0;
  uint32_t release_us_ = 0;
  uint32_t level_q15_ = 0;
  uint32_t sustain_q15_ = 0;  // the level after the decay
  uint32_t lift_pulse_us_ = 0;
  uint32_t lift_level_q15_ = 0;

  bool is_decaying_ = false;  // or decayed
  uint32_t line_us_ = 0;      // when the line it is on began
  uint32_t line_ramp_us_ = 0;
};

}  // namespace chladni
