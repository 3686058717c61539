#include "core/device/touch_playback.hpp"

#include "core/table/coil_gains.hpp"

namespace chladni {

void TouchPlayback::begin(Place place, uint32_t now_us) {
  place_ = place;
  line_ = envelope_.begin(now_us);
  next_ = Next::kStart;
}

void TouchPlayback::move(Place place, uint32_t now_us) {
  if (place.x_um == place_.x_um && place.y_um == place_.y_um) return;
  place_ = place;
  if (!is_starting()) line_ = envelope_.current(now_us);
  change();
}

void TouchPlayback::lift(uint32_t now_us) {
  lifted_us_ = now_us;
  line_ = envelope_.lift_line();
  change();
}

void TouchPlayback::advance(uint32_t now_us) {
  if (is_starting() || !envelope_.decays(now_us)) return;
  line_ = envelope_.current(now_us);
  change();
}

bool TouchPlayback::post(Synthesis& synthesis, const Table& table, const Config& config,
                         const CoilHeat& heat) {
  if (next_ == Next::kNothing) return false;
  if (next_ == Next::kStop) {
    synthesis.stop();
    next_ = Next::kNothing;
    return false;
  }
  if (next_ == Next::kFade) {
    if (synthesis.release(envelope_.release_us())) next_ = Next::kNothing;
    return false;
  }
  Drive drive{};
  table.drive_at(place_, drive);
  apply_coil_gains(config, drive);
  heat.even_out(drive);
  const bool is_start = is_starting();
  if (!synthesis.play(drive, {line_.level_q15, line_.ramp_us, is_start})) return false;
  next_ = Next::kNothing;
  return is_start;
}

}  // namespace chladni
