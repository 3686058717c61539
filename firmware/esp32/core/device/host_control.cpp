// A host that drives the outputs itself.
#include "core/device/device.hpp"
#include "core/table/coil_gains.hpp"

namespace chladni {

void Device::restart_soon() {
  if (state_ != DeviceState::kRestarting) starts_.ask_restart(now_ms());
  silence();
  go(DeviceEvent::kRestartAsked);
}

void Device::trust_host() {
  Starts::trust_host(faults_);
  if (state_ == DeviceState::kFault && !faults_.any_stands()) go(DeviceEvent::kFaultClears);
}

bool Device::stream_begin(uint32_t target) {
  trust_host();
  if (state_ == DeviceState::kFault && !faults_.only_the_table_stands()) return false;
  if (!go(DeviceEvent::kStreamBegins)) return false;
  touch_.fade_out();
  host_drive_ = HostDrive::kClearing;
  stream_target_ = target;
  host_is_heard();
  return true;
}

bool Device::stream_push(const uint16_t* duties_q16) {
  if (host_drive_ != HostDrive::kFilling && host_drive_ != HostDrive::kRunning) return false;
  host_is_heard();
  return synthesis_.stream().push(duties_q16);
}

bool Device::play_live(const Drive& drive, uint32_t frequency_millihertz, Waveform waveform) {
  if (state_ != DeviceState::kStreaming) {
    if (!stream_begin()) return false;
    host_drive_ = HostDrive::kWaves;
  }
  if (host_drive_ != HostDrive::kWaves || touch_.is_fading()) return false;
  if (!synthesis_.set_frequency(frequency_millihertz) || !synthesis_.set_waveform(waveform))
    return false;
  watch_outputs();
  if (state_ != DeviceState::kStreaming) {
    forget_host();
    return false;
  }
  host_is_heard();
  Drive made = drive;
  apply_coil_gains(config(), made);
  // Each one is a touch of its own: a host that goes on asking may go on for long.
  if (synthesis_.is_quiet()) keep_retained(true);
  if (!synthesis_.play(made, {32767, synthesis_settings().ramp_us, true})) return false;
  output_watch_.expect_play();
  return true;
}

void Device::stream_end() {
  if (!go(DeviceEvent::kStreamEnds)) return;
  forget_host();
  touch_.fade_out();
  settle();
}

// Fingers get the table's frequency and the configured wave again.
void Device::forget_host() {
  const bool has_waves = host_drive_ == HostDrive::kWaves;
  host_drive_ = HostDrive::kNone;
  if (!has_waves) return;
  synthesis_.set_frequency(synthesis_settings().frequency_millihertz);
  synthesis_.set_waveform(static_cast<Waveform>(config().waveform));
}

void Device::host_is_heard() {
  synthesis_.keep_alive();
  host_us_ = hal_.now_us(hal_.context);
}

void Device::advance_stream() {
  if (state_ != DeviceState::kStreaming) return;
  if (hal_.now_us(hal_.context) - host_us_ >= synthesis_settings().touch_timeout_us) {
    note(FaultCause::kHostSilent, 0);
    stream_end();
    return;
  }
  if (host_drive_ == HostDrive::kWaves) return;
  if (host_drive_ == HostDrive::kClearing) {
    if (!are_outputs_free()) return;
    synthesis_.stream().aim(stream_target_);
    synthesis_.stream().clear();
    host_drive_ = HostDrive::kFilling;
  }
  synthesis_.stream().steer();
  const bool may_begin = host_drive_ == HostDrive::kFilling && synthesis_.stream().is_ready();
  if (may_begin) keep_retained(true);
  if (may_begin && synthesis_.play_stream()) {
    output_watch_.expect_play();
    host_drive_ = HostDrive::kRunning;
  }
}

Place Device::touch(Place place) {
  trust_host();
  const Place found = table().is_loaded() ? table().on_board(place) : place;
  input_.hold(found);
  return found;
}

void Device::lift() {
  if (input_.let_go()) touch_up(hal_.now_us(hal_.context));
}

}  // namespace chladni
