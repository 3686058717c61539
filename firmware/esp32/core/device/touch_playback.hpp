// How a touch plays: where, how loud, and what the sample interrupt is told next. The interrupt
// takes one command at a time, so what is next waits here; the last one counts.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/hal.hpp"
#include "core/limits/coil_heat.hpp"
#include "core/synthesis/envelope.hpp"
#include "core/synthesis/synthesis.hpp"
#include "core/table/table.hpp"

namespace chladni {

class TouchPlayback {
 public:
  // Only while nothing plays.
  void start(const Config& config, uint32_t table_ramp_us) {
    envelope_.start(config, table_ramp_us);
  }

  void begin(Place place, uint32_t now_us);
  void move(Place place, uint32_t now_us);
  // The finger has left, and its lift pulse plays.
  void lift(uint32_t now_us);
  bool has_lift_pulse() const { return envelope_.lift_pulse_us() > 0; }
  bool is_lift_over(uint32_t now_us) const {
    return now_us - lifted_us_ >= envelope_.lift_pulse_us();
  }
  // While a finger is there, each turn: from the attack to the decay.
  void advance(uint32_t now_us);
  // Outputs fade out, whoever plays.
  void fade_out() { next_ = Next::kFade; }
  // The same, in the table's ramp however long a release is; if they are off already, nothing is
  // next.
  void stop(const Synthesis& synthesis) {
    next_ = synthesis.is_quiet() ? Next::kNothing : Next::kStop;
  }

  // What the interrupt was not told yet: a start, or to fade out.
  bool is_starting() const { return next_ == Next::kStart; }
  bool is_fading() const { return next_ == Next::kFade || next_ == Next::kStop; }

  // Tells it what is next, if it has room. True once that has started a touch.
  bool post(Synthesis& synthesis, const Table& table, const Config& config, const CoilHeat& heat);

 private:
  enum class Next : uint8_t {
    kNothing,
    kChange,  // to another drive of the same touch
    kStart,   // of a touch
    kFade,    // in the release's time
    kStop,    // at once
  };

  // To another place or line; a start that the interrupt was not told yet stays one.
  void change() {
    if (next_ != Next::kStart) next_ = Next::kChange;
  }

  Envelope envelope_;
  Next next_ = Next::kNothing;
  Place place_{};
  Line line_{};
  uint32_t lifted_us_ = 0;
};

}  // namespace chladni
