#include "core/device/device.hpp"

namespace chladni {

void Device::start(const Hal& hal) {
  hal_ = hal;
  state_ = DeviceState::kIdle;
  const uint32_t now_us = hal_.now_us(hal_.context);
  clock_.start(now_us);
  output_watch_.start(now_us);
  starts_.begin(hal_, faults_);
  config_.load(hal_);
  if (config_status() == ConfigStatus::kNone) {
    stand(FaultCause::kNotConfigured, 0);
  } else if (!config_.is_whole()) {
    stand(FaultCause::kConfigRefused, static_cast<uint32_t>(config_status()));
  }
  Retained before;
  const bool is_known = recall(hal_, before);
  heat_.start(config(), is_known ? before.rise_uk.data() : nullptr, before.is_on != 0);
  wear_.start(before.erases, before.write_credit_ms);
  load_table();
  start_outputs();
  input_.start(config(), table().is_loaded() ? table().touch_timeout_us() : kDefaultTimeoutUs);
  panel_watch_.start(config());
  settle();
}

// Only while nothing plays.
void Device::start_outputs() {
  const SynthesisSettings settings = synthesis_settings();
  const bool fits = synthesis_.start(settings);
  if (!fits && table_status() == TableStatus::kOk) {
    table_.refuse();
    refuse_table();
  }
  synthesis_.set_waveform(static_cast<Waveform>(config().waveform));
  touch_.start(config(), settings.ramp_us);
  const uint32_t ramp_ms = settings.ramp_us / 1000U + 1U;
  const uint32_t release_ms = config().release_ms > ramp_ms ? config().release_ms : ramp_ms;
  heat_.set_reaction(settings.touch_timeout_us / 1000U + release_ms);
}

SynthesisSettings Device::synthesis_settings() const {
  SynthesisSettings settings{};
  settings.channels = config().channels;
  settings.pwm_bits = config().pwm_bits;
  const bool has_table = table().is_loaded();
  settings.frequency_millihertz =
      has_table ? table().frequency_millihertz() : kDefaultFrequencyMillihertz;
  settings.ramp_us = has_table ? table().ramp_us() : kDefaultRampUs;
  settings.touch_timeout_us = has_table ? table().touch_timeout_us() : kDefaultTimeoutUs;
  settings.max_on_us = has_table ? table().max_on_us() : kDefaultMaxOnUs;
  settings.limits.max_duty_q15 = config().max_duty_q15;
  // A step of the carrier is 12.5 ns.
  settings.limits.min_on_steps = (config().min_on_ns * 2U + 24U) / 25U;
  settings.limits.supply_ma = config().supply_ma;
  settings.limits.full_current_ma = config().full_current_ma;
  return settings;
}

bool Device::go(DeviceEvent event) {
  const Transition* const found = transition(state_, event);
  if (found == nullptr) return false;
  const bool did_play = is_of_a_finger();
  state_ = found->next;
  if (did_play && !is_of_a_finger()) played_.stop(now_ms());
  if (!did_play && is_of_a_finger()) played_.start(now_ms());
  return true;
}

void Device::note(FaultCause cause, uint32_t detail) { faults_.add(cause, detail, now_ms()); }

// Outputs go off and stay off until the fault clears.
void Device::stand(FaultCause cause, uint32_t detail) {
  faults_.raise(cause, detail, now_ms());
  silence();
  go(DeviceEvent::kFaultArises);
}

void Device::settle() {
  if (state_ == DeviceState::kIdle && faults_.any_stands()) go(DeviceEvent::kFaultArises);
}

void Device::poll() {
  const uint32_t now_us = hal_.now_us(hal_.context);
  const uint32_t passed_ms = clock_.turn(now_us);
  watch_samples(now_us);
  watch_outputs();
  watch_coils(passed_ms);
  const TouchEvent event = input_.poll(hal_, now_us);
  panel_watch_.look(input_, faults_, now_ms());
  // The panel's bytes took their time.
  handle(event, hal_.now_us(hal_.context));
  advance_touch(hal_.now_us(hal_.context));
  advance_stream();
  watch_update();
  watch_flash();
  post_touch();
  clear_faults();
  const bool must_restart = state_ == DeviceState::kRestarting;
  if (must_restart && starts_.is_restart_due(now_ms(), is_quiet())) hal_.restart(hal_.context);
  starts_.settle(hal_, now_ms(), is_quiet());
}

// All deadlines are counted by the interrupt; if it dies, a duty stays where it was. The gates are
// cut past it, and only a start gives them back.
void Device::watch_samples(uint32_t now_us) {
  const uint32_t stopped_us = output_watch_.stopped_us(synthesis_, now_us);
  if (stopped_us == 0 || faults_.stands(FaultCause::kInterruptStopped)) return;
  hal_.cut_outputs(hal_.context);
  stand(FaultCause::kInterruptStopped, stopped_us / 1000U);
}

// What the interrupt ended by itself.
void Device::watch_outputs() {
  if (touch_.is_starting()) return;
  switch (output_watch_.fade(synthesis_)) {
    case FadeCause::kTouchTimeout:
      if (is_of_a_finger()) {
        note(FaultCause::kTouchTimeout, 0);
        end_touch();
      } else if (state_ == DeviceState::kStreaming) {
        note(FaultCause::kHostSilent, 0);
        stream_end();
      }
      break;
    case FadeCause::kMaxOn:
      // A finger has to lift first; a host may have died, and must not be in the next finger's way.
      if (input_.let_go() && is_of_a_finger()) {
        note(FaultCause::kTouchTooLong, 0);
        end_touch();
      } else {
        stand(FaultCause::kTouchTooLong, 0);
      }
      break;
    case FadeCause::kLate: stand(FaultCause::kInterruptLate, synthesis_.missed()); break;
    case FadeCause::kUnderrun:
      note(FaultCause::kUnderrun, 0);
      // It begins again when enough has come.
      if (host_drive_ == HostDrive::kRunning) host_drive_ = HostDrive::kFilling;
      break;
    case FadeCause::kNone:
    case FadeCause::kReleased: break;
  }
}

void Device::watch_coils(uint32_t passed_ms) {
  if (passed_ms > 0) {
    Loads loads;
    synthesis_.take_loads(loads, passed_ms);
    if (heat_.add(loads, passed_ms)) keep_retained(!synthesis_.is_quiet());
    wear_.pass(passed_ms);
  }
  const uint32_t hot = heat_.hot_channel();
  if (hot < kMaxChannels && !faults_.stands(FaultCause::kCoilHot)) {
    stand(FaultCause::kCoilHot, hot);
  }
  // Waves are kept within the limit when they are posted; a stream is not, and rounding is not.
  const uint32_t most_ma = config().supply_ma + config().supply_ma / 16U;
  if (heat_.supply_ma() > most_ma && !faults_.stands(FaultCause::kSupplyCurrent)) {
    stand(FaultCause::kSupplyCurrent, heat_.supply_ma());
  }
}

void Device::clear_faults() {
  if (!input_.is_touched() && synthesis_.is_quiet()) {
    if (heat_.has_cooled()) faults_.clear(FaultCause::kCoilHot);
    faults_.clear(FaultCause::kTouchTooLong);
    faults_.clear(FaultCause::kInterruptLate);
    // The mean that raised it goes on for a window.
    if (heat_.supply_ma() <= config().supply_ma) faults_.clear(FaultCause::kSupplyCurrent);
  }
  if (state_ == DeviceState::kFault && !faults_.any_stands()) go(DeviceEvent::kFaultClears);
}

void Device::handle(const TouchEvent& event, uint32_t now_us) {
  switch (event.kind) {
    case TouchKind::kNothing: return;
    case TouchKind::kUp: touch_up(now_us); return;
    case TouchKind::kTimeout:
      if (!is_of_a_finger()) return;
      note(FaultCause::kTouchTimeout, 0);
      end_touch();
      return;
    case TouchKind::kDown:
    case TouchKind::kHeld:
    case TouchKind::kMoved: break;
  }
  const bool is_new = state_ == DeviceState::kIdle || state_ == DeviceState::kLifted ||
                      event.kind == TouchKind::kDown;
  if (is_new) {
    touch_down(event.place, now_us);
    return;
  }
  if (state_ != DeviceState::kPlaying) return;
  synthesis_.keep_alive();
  if (config().on_move == 0) touch_.move(event.place, now_us);
}

void Device::touch_down(Place place, uint32_t now_us) {
  // What ended the last touch is noted before this one wipes it out.
  watch_outputs();
  if (!go(DeviceEvent::kTouchBegins)) return;
  touch_.begin(place, now_us);
  synthesis_.keep_alive();
}

void Device::touch_up(uint32_t now_us) {
  if (state_ != DeviceState::kPlaying) return;
  if (!touch_.has_lift_pulse()) {
    end_touch();
    return;
  }
  go(DeviceEvent::kFingerLifts);
  touch_.lift(now_us);
}

// Whoever plays stops, and outputs fade out.
void Device::silence() {
  forget_host();
  touch_.stop(synthesis_);
}

void Device::end_touch() {
  touch_.fade_out();
  go(DeviceEvent::kTouchEnds);
  settle();
}

void Device::advance_touch(uint32_t now_us) {
  if (state_ == DeviceState::kPlaying) touch_.advance(now_us);
  if (state_ != DeviceState::kLifted) return;
  synthesis_.keep_alive();
  if (touch_.is_lift_over(now_us)) end_touch();
}

void Device::post_touch() {
  if (touch_.is_starting()) keep_retained(true);
  if (touch_.post(synthesis_, table(), config())) output_watch_.expect_play();
}

bool Device::set_waveform(Waveform waveform) { return synthesis_.set_waveform(waveform); }

// The drives of another frequency, from the next touch on.
TableStatus Device::select_frequency(uint32_t frequency_millihertz) {
  const TableStatus status = table_.select(frequency_millihertz);
  if (table_.is_damaged()) refuse_table();
  if (status == TableStatus::kOk) synthesis_.set_frequency(frequency_millihertz);
  return status;
}

}  // namespace chladni
