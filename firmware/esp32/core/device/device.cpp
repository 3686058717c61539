#include "core/device/device.hpp"

#include "core/storage/retained.hpp"

namespace chladni {

namespace {

// What the table says of touches, or stands in while there is none.
struct Timing {
  uint32_t frequency_millihertz = 160000;
  uint32_t ramp_us = 4000;
  uint32_t touch_timeout_us = 100000;
  uint32_t max_on_us = 10000000;
};

Timing timing_of(const Table& table) {
  if (!table.is_loaded()) return {};
  return {table.frequency_millihertz(), table.ramp_us(), table.touch_timeout_us(),
          table.max_on_us()};
}

SynthesisSettings settings_of(const Timing& timing, const Config& config) {
  SynthesisSettings settings{};
  settings.channels = config.channels;
  settings.pwm_bits = config.pwm_bits;
  settings.frequency_millihertz = timing.frequency_millihertz;
  settings.ramp_us = timing.ramp_us;
  settings.touch_timeout_us = timing.touch_timeout_us;
  settings.max_on_us = timing.max_on_us;
  settings.has_bridges = config.driver == kBridge;
  settings.lost_steps = lost_steps(config.lost_ns);
  settings.sign_pins = config.sign_pins;
  settings.limits.max_duty_q15 = config.max_duty_q15;
  // A step of the carrier is 12.5 ns.
  settings.limits.min_on_steps = (config.min_on_ns * 2U + 24U) / 25U;
  settings.limits.supply_ma = config.supply_ma;
  settings.limits.full_current_ma = config.full_current_ma;
  return settings;
}

}  // namespace

void Device::start(const Hal& hal, const FirstCounts& first) {
  hal_ = hal;
  clock_.start(now_us(), first.ms);
  synthesis_.count_from(first.samples);
  output_watch_.start(now_us());
  starts_.begin(hal_, faults_);
  load_config();
  const Retained before = recall(hal_);
  known_heat_ = before.heat;
  heat_.start(config(), known_heat_, before.is_on != 0);
  supply_.start(config());
  wear_.start(starts_.log(), before.erases, before.write_credit_ms);
  load_table();
  load_bank();
  start_outputs();
  input_.start(config(), touch_timeout_us());
  input_.follow_all(table().has_responses());
  panel_watch_.start(config());
  sense_.start(config(), now_ms());
  settle();
}

uint32_t Device::touch_timeout_us() const { return timing_of(table()).touch_timeout_us; }
uint32_t Device::ramp_us() const { return timing_of(table()).ramp_us; }

// Only while nothing plays.
void Device::start_outputs() {
  const Timing timing = timing_of(table());
  const bool fits = synthesis_.start(hal_, settings_of(timing, config()));
  if (!fits && table_status() == TableStatus::kOk) {
    table_.refuse();
    refuse_table();
  }
  synthesis_.set_waveform(static_cast<Waveform>(config().waveform));
  touch_.start(config(), timing.ramp_us, effects_.has_bank());
  const uint32_t ramp_ms = timing.ramp_us / 1000U + 1U;
  const uint32_t release_ms = config().release_ms > ramp_ms ? config().release_ms : ramp_ms;
  heat_.set_reaction(timing.touch_timeout_us / 1000U + release_ms);
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

// Where nothing else goes on, the state shows whether a fault stands.
void Device::settle() {
  const bool does_stand = faults_.any_stands();
  if (state_ == DeviceState::kIdle && does_stand) go(DeviceEvent::kFaultArises);
  if (state_ == DeviceState::kFault && !does_stand) go(DeviceEvent::kFaultClears);
}

// Outputs go off and stay off until the fault clears.
void Device::stand(FaultCause cause, uint32_t detail) {
  faults_.raise(cause, detail, now_ms());
  silence();
  go(DeviceEvent::kFaultArises);
}

// Whoever plays stops, and outputs fade out.
void Device::silence() {
  effects_.clear(now_ms());
  host_ends();
  touch_.stop(synthesis_);
}

void Device::poll() {
  const uint32_t passed_ms = clock_.turn(now_us());
  watch_samples();
  watch_outputs();
  watch_limits(passed_ms);
  wear_.pass(hal_, passed_ms, is_quiet());
  const TouchEvent event = input_.poll(hal_, now_us());
  panel_watch_.look(input_, faults_, now_ms());
  handle(event);
  advance_touch();
  advance_host();
  advance_sense();
  watch_update();
  watch_flash();
  post_touch();
  clear_faults();
  const bool must_restart = state_ == DeviceState::kRestarting;
  if (must_restart && starts_.is_restart_due(now_ms(), is_quiet())) {
    starts_.restart(hal_, is_quiet());
  }
  starts_.settle(hal_, now_ms(), is_quiet());
}

void Device::trust_host() {
  Starts::trust_host(faults_);
  settle();
}

Place Device::touch(Place place, const void* host, uint32_t finger) {
  trust_host();
  const Place found = table().is_loaded() ? table().on_board(place) : place;
  input_.hold(finger, found, host, now_us());
  return found;
}

void Device::lift() {
  if (input_.let_go()) touch_up();
}

void Device::lift(uint32_t finger) {
  if (input_.let_go(finger)) touch_up();
}

void Device::handle(const TouchEvent& event) {
  switch (event.kind) {
    case TouchKind::kNothing: return;
    case TouchKind::kUp: touch_up(); return;
    case TouchKind::kTimeout:
    case TouchKind::kSilent:
      if (!is_of_a_finger()) return;
      note(cause_of(event.kind), 0);
      break_touch();
      return;
    case TouchKind::kDown:
    case TouchKind::kHeld:
    case TouchKind::kMoved: break;
  }
  const bool is_new = state_ == DeviceState::kIdle || state_ == DeviceState::kLifted ||
                      event.kind == TouchKind::kDown;
  if (is_new) {
    touch_down();
  } else if (state_ == DeviceState::kPlaying) {
    synthesis_.keep_alive();
  }
}

void Device::touch_down() {
  // What ended the last touch is noted before this one wipes it out.
  watch_outputs();
  if (!go(DeviceEvent::kTouchBegins)) return;
  effects_.clear(now_ms());
  touch_.begin(input_.touches(), now_us());
  synthesis_.keep_alive();
}

// The last finger has left, and an effect of its release plays.
bool Device::let_effects_end() {
  effects_.follow({}, touch_.bank_fingers(), now_ms());
  return effects_.are_lingering() && go(DeviceEvent::kFingerLifts);
}

void Device::touch_up() {
  if (state_ != DeviceState::kPlaying || let_effects_end()) return;
  if (!touch_.has_lift_pulse()) {
    end_touch();
    return;
  }
  go(DeviceEvent::kFingerLifts);
  touch_.lift(now_us());
}

void Device::end_touch() {
  effects_.clear(now_ms());
  touch_.fade_out();
  go(DeviceEvent::kTouchEnds);
  settle();
}

// By no one's will: in the table's ramp, however long a release is.
void Device::break_touch() {
  effects_.clear(now_ms());
  touch_.stop(synthesis_);
  go(DeviceEvent::kTouchEnds);
  settle();
}

void Device::advance_touch() {
  if (!is_of_a_finger()) return;
  const bool is_lifted = state_ == DeviceState::kLifted;
  if (!is_lifted || effects_.are_lingering()) {
    const Touches down = is_lifted ? Touches{} : input_.touches();
    const Touches heard = effects_.follow(down, touch_.bank_fingers(), now_ms());
    touch_.follow(heard, table(), config().on_move == 0, now_us());
    touch_.spare(is_lifted ? Bystanders{} : input_.bystanders(), table());
    for (uint32_t s = 0; s < kMaxFingers; ++s) touch_.limit(s, effects_.most_10nm(s));
    touch_.advance(table(), now_us());
    for (uint32_t s = 0; s < kMaxFingers; ++s) {
      if (touch_.plays_bank(s)) effects_.render(s, signal(s));
    }
  }
  if (!is_lifted) return;
  synthesis_.keep_alive();
  if (!effects_.are_lingering() && touch_.is_lift_over(now_us())) end_touch();
}

bool Device::play_effect(uint32_t finger, uint32_t effect, uint32_t level_q15) {
  return has_bank_finger(finger) && effects_.play(finger, effect, level_q15);
}

void Device::post_touch() {
  if (touch_.is_starting() && !supply_.may_start_wave()) return;
  if (touch_.is_starting()) keep_retained(true);
  if (touch_.post(synthesis_, table(), config(), heat_, now_us())) output_watch_.expect_play();
}

// The drives of another frequency, from the next touch on.
TableStatus Device::select_frequency(uint32_t frequency_millihertz) {
  const TableStatus status = table_.select(frequency_millihertz);
  if (table_.is_damaged()) refuse_table();
  if (status == TableStatus::kOk) synthesis_.set_frequency(frequency_millihertz);
  input_.follow_all(table().has_responses());
  return status;
}

bool Device::host_begins() {
  trust_host();
  if (state_ == DeviceState::kFault && !faults_.only_the_table_stands()) return false;
  if (!go(DeviceEvent::kStreamBegins)) return false;
  effects_.clear(now_ms());
  touch_.fade_out();
  host_.hear(synthesis_, now_us());
  return true;
}

// Fingers get the table's frequency and the configured wave again.
void Device::host_ends() {
  sense_.end(hal_, SenseState::kStopped);
  if (!host_.end()) return;
  synthesis_.set_frequency(timing_of(table()).frequency_millihertz);
  synthesis_.set_waveform(static_cast<Waveform>(config().waveform));
}

bool Device::stream_begin(uint32_t target) {
  if (!host_begins()) return false;
  host_.begin_stream(target);
  return true;
}

bool Device::stream_push(const uint16_t* duties_q16) {
  const DutyRing& frames = synthesis_.stream();
  const uint32_t frame_ma = frames.frame_ma(duties_q16);
  const uint32_t crest_ma = frame_ma > frames.crest_ma() ? frame_ma : frames.crest_ma();
  if (supply_.would_pass(synthesis_.stream_charge(frame_ma), synthesis_.stream_ms(), crest_ma)) {
    if (state_ == DeviceState::kStreaming) stand_supply();
    return false;
  }
  const bool is_taken = host_.push(synthesis_, duties_q16, now_us());
  if (is_taken) supply_.note_stream();
  return is_taken;
}

bool Device::play_live(const Drive& drive, uint32_t frequency_millihertz, Waveform waveform) {
  if (state_ != DeviceState::kStreaming) {
    if (!host_begins()) return false;
    host_.begin_waves();
  }
  if (!host_.has_waves() || sense_.is_running()) return false;
  if (touch_.is_fading() || !supply_.may_start_wave()) return false;
  if (!synthesis_.set_frequency(frequency_millihertz) || !synthesis_.set_waveform(waveform))
    return false;
  watch_outputs();
  if (state_ != DeviceState::kStreaming) return false;
  if (is_quiet()) keep_retained(true);
  if (!host_.play(synthesis_, config(), drive, ramp_us(), now_us())) return false;
  output_watch_.expect_play();
  return true;
}

void Device::stream_end() {
  if (!go(DeviceEvent::kStreamEnds)) return;
  host_ends();
  touch_.stop(synthesis_);
  settle();
}

void Device::advance_host() {
  if (state_ != DeviceState::kStreaming) return;
  if (host_.is_silent(now_us(), touch_timeout_us())) {
    if (host_.is_driving()) note(FaultCause::kHostSilent, 0);
    stream_end();
    return;
  }
  if (!host_.is_ready(synthesis_, are_outputs_free())) return;
  keep_retained(true);
  if (host_.play_stream(synthesis_)) output_watch_.expect_play();
}

void Device::restart_soon() {
  if (state_ != DeviceState::kRestarting) starts_.ask_restart(now_ms());
  silence();
  go(DeviceEvent::kRestartAsked);
}

}  // namespace chladni
