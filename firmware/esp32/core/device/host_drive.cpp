#include "core/device/host_drive.hpp"

#include "core/table/coil_gains.hpp"

namespace chladni {

void HostDrive::begin_stream(uint32_t target) {
  mode_ = Mode::kClearing;
  is_driving_ = true;
  target_ = target;
}

void HostDrive::hear(Synthesis& synthesis, uint32_t now_us) {
  synthesis.keep_alive();
  heard_us_ = now_us;
}

bool HostDrive::end() {
  const bool had_waves = has_waves();
  mode_ = Mode::kNone;
  return had_waves;
}

// Each one is a touch of its own: a host that goes on asking may go on for long.
bool HostDrive::play(Synthesis& synthesis, const Config& config, const Drive& drive,
                     uint32_t ramp_us, uint32_t now_us) {
  hear(synthesis, now_us);
  Drive made = drive;
  apply_coil_gains(config, made);
  if (!synthesis.play(made, {32767, ramp_us, true})) return false;
  is_driving_ = true;
  return true;
}

bool HostDrive::push(Synthesis& synthesis, const uint16_t* duties_q16, uint32_t now_us) {
  if (mode_ != Mode::kFilling && mode_ != Mode::kRunning) return false;
  hear(synthesis, now_us);
  return synthesis.stream().push(duties_q16);
}

bool HostDrive::is_ready(Synthesis& synthesis, bool are_outputs_free) {
  if (mode_ == Mode::kNone || mode_ == Mode::kWaves) return false;
  DutyRing& ring = synthesis.stream();
  if (mode_ == Mode::kClearing) {
    if (!are_outputs_free) return false;
    ring.aim(target_);
    ring.clear();
    mode_ = Mode::kFilling;
  }
  ring.steer();
  return mode_ == Mode::kFilling && ring.is_ready();
}

bool HostDrive::play_stream(Synthesis& synthesis) {
  if (!synthesis.play_stream()) return false;
  mode_ = Mode::kRunning;
  return true;
}

}  // namespace chladni
