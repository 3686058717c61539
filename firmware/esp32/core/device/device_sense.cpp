// Coils that measure each other: a host asks, and the device plays and listens by itself.
#include "core/device/device.hpp"

namespace chladni {

link_format::Status Device::sense(const SenseRequest& request) {
  using link_format::Status;
  if (request.motions > 0 ? !sense_.has_bus() : !sense_.is_wired()) return Status::kNotWired;
  if (sense_.is_running()) return Status::kBusy;
  if (state_ == DeviceState::kStreaming || !host_begins()) return Status::kNotNow;
  host_.begin_sensing();
  sense_.ask(request, now_ms());
  return Status::kOk;
}

// Whoever ends the host's drive ends a reading with it (host_ends).
void Device::advance_sense() {
  if (sense_.is_running() && input_.is_touched()) {
    sense_.end(hal_, SenseState::kTouched);
    stream_end();
  }
  const bool did_run = sense_.is_running();
  sense_.turn(hal_, synthesis_, now_ms());
  if (sense_.take_missing()) note(FaultCause::kExpanderMissing, 0);
  if (!did_run) return;
  if (!sense_.is_running()) {
    stream_end();
    return;
  }
  host_.hear(synthesis_, now_us());
  const bool may_play = are_outputs_free() && supply_.may_start_wave();
  if (!sense_.wants_play() || !may_play) return;
  keep_retained(true);
  const SenseRequest& asked = sense_.request();
  const auto gain_q15 = static_cast<int16_t>(asked.level_q15);
  if (!synthesis_.play_alone(asked.playing, gain_q15, sense_.frequency_millihertz(),
                             sense_.phase_step_u32(), ramp_us())) {
    return;
  }
  output_watch_.expect_play();
  sense_.note_play(synthesis_.amplitude_q16(asked.playing));
}

}  // namespace chladni
