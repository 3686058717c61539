#include "core/sensing/coil_sense.hpp"

#include "core/generated/link_format.hpp"
#include "core/sensing/expander.hpp"
#include "core/storage/config.hpp"

namespace chladni {

namespace {

namespace f = link_format;

// Of the slowest sine, of which what is played is a multiple.
constexpr uint32_t kPeriodPairs = 2U * f::kSensePairs;
// 2^32 by that many pairs, and what is left of it.
constexpr uint32_t kUnitStep = 4400580, kUnitRest = 1216;
static_assert(static_cast<uint64_t>(kUnitStep) * kPeriodPairs + kUnitRest == uint64_t{1} << 32);
// From one coil to the next: the multiplexer's input, and what the converter has not handed out.
constexpr uint32_t kSettleMs = 3;
// The converter goes on for so long after a request.
constexpr uint32_t kSilenceMs = f::kTouchSilenceMs;
constexpr uint32_t kRetryMs = 250;
constexpr int32_t kMiddle = 2048;
// An ESP32's converter is straight from 0.15 to 2.45 V (its data sheet), 200 to 3240 steps.
constexpr uint16_t kLowest = 200, kHighest = 3240;
// Values that may be on their way once all that has come was fetched: two frames of the DMA, a turn
// of the main loop, and the converter's start.
constexpr int32_t kMostOnTheWay = 320;
constexpr uint32_t kAtOnce = 128;
// Values of a turn: eight times as many as come in its millisecond.
constexpr uint32_t kMostInTurn = 640;

constexpr uint32_t pairs_in(uint32_t milliseconds) { return milliseconds * 39063U / 1000U; }

}  // namespace

void CoilSense::start(const Config& config, uint32_t now_ms) {
  woken_ms_ = now_ms - kRetryMs;  // at once
  has_bus_ = config.panel != 0;
  is_wired_ = has_sensing_pin(config) && has_bus_;
  has_bridges_ = config.driver == kBridge;
  channels_ = config.channels;
  sample_bits_ = config.pwm_bits - 9U;
}

void CoilSense::ask(const SenseRequest& request, uint32_t now_ms) {
  request_ = request;
  asked_ms_ = now_ms;
  step_u32_ = request.multiple * kUnitStep +
              (request.multiple * kUnitRest + kPeriodPairs / 2U) / kPeriodPairs;
  state_ = SenseState::kRunning;
  stage_ = request.motions > 0 ? Stage::kToFind : Stage::kToPlay;
  is_too_loud_ = has_reference_ = false;
  count_ = 0;
  coil_ = 0;
}

uint32_t CoilSense::frequency_millihertz() const { return request_.multiple * f::kSenseMillihertz; }

void CoilSense::note_play(uint32_t amplitude_q16) {
  amplitude_q16_ = amplitude_q16;
  stage_ = Stage::kToBegin;
}

void CoilSense::turn(const Hal& hal, const Synthesis& synthesis, uint32_t now_ms) {
  if (is_running() && request_.motions > 0) {
    turn_motion(hal, synthesis);
    return;
  }
  if (!is_wired_) return;
  if (!is_running()) {
    if (is_listening_ && now_ms - asked_ms_ >= kSilenceMs) stop_listening(hal);
    if (!are_awake_ && now_ms - woken_ms_ >= kRetryMs) wake_all(hal, now_ms);
  }
  if (is_listening_) read(hal, synthesis);
  if (!is_running()) return;
  asked_ms_ = now_ms;
  if (stage_ == Stage::kToPlay) {
    if (!is_listening_ && !listen(hal, synthesis)) end(hal, SenseState::kNoConverter);
  } else if (stage_ == Stage::kToBegin && synthesis.output() == Output::kPlaying) {
    phase_from_ = (synthesis.begun() - begun_at_) << sample_bits_;
    stage_ = Stage::kToSelect;
  }
  if (is_running() && stage_ == Stage::kToSelect) select_next(hal, synthesis);
}

void CoilSense::turn_motion(const Hal& hal, const Synthesis& synthesis) {
  if (is_listening_) stop_listening(hal);
  const uint32_t now = synthesis.samples();
  switch (stage_) {
    case Stage::kToFind:
      stage_ = Stage::kToPlay;
      if (!accelerometer_.begin(hal)) end(hal, SenseState::kNoAccelerometer);
      return;
    case Stage::kToBegin:
      if (synthesis.output() != Output::kPlaying) return;
      from_ = now + (pairs_in(request_.settle_ms) >> sample_bits_);
      stage_ = Stage::kToSelect;
      return;
    case Stage::kToSelect:
      if (static_cast<int32_t>(now - from_) < 0) return;
      stage_ = Stage::kListening;
      if (!accelerometer_.take(hal, request_.motions)) end(hal, SenseState::kNoAccelerometer);
      return;
    case Stage::kListening:
      if (!accelerometer_.read(hal, now - synthesis.begun())) end(hal, SenseState::kLost);
      if (accelerometer_.is_full()) end(hal, SenseState::kDone);
      return;
    case Stage::kToPlay: return;
  }
}

void CoilSense::end(const Hal& hal, SenseState state) {
  if (!is_running()) return;
  state_ = state;
  if (request_.motions > 0) return;
  are_awake_ = expander::rest(hal);
}

// After a start nothing is known of the expander, which may have been left by another one.
void CoilSense::wake_all(const Hal& hal, uint32_t now_ms) {
  woken_ms_ = now_ms;
  are_awake_ = expander::rest(hal);
  is_missing_ = !are_awake_;
}

bool CoilSense::listen(const Hal& hal, const Synthesis& synthesis) {
  if (hal.start_listening == nullptr) return false;
  begun_at_ = synthesis.samples();
  if (!hal.start_listening(hal.context)) return false;
  is_listening_ = true;
  session_ = (session_ + 1U) & 0xFFFFU;
  values_ = 0;
  return true;
}

void CoilSense::stop_listening(const Hal& hal) {
  hal.stop_listening(hal.context);
  is_listening_ = false;
}

// What has come since, and whether as much has come as must have: a converter that stands still,
// goes at another pace or was not listened to for too long does not tell so.
void CoilSense::read(const Hal& hal, const Synthesis& synthesis) {
  std::array<uint16_t, kAtOnce> values;
  uint32_t count = kAtOnce;
  for (uint32_t done = 0; done < kMostInTurn && count == kAtOnce; done += kAtOnce) {
    count = hal.heard(hal.context, values.data(), kAtOnce);
    if (count == kValuesLost) return lose(hal);
    for (uint32_t k = 0; k < count; ++k) take(values[k]);
  }
  const uint32_t due = (synthesis.samples() - begun_at_) << (sample_bits_ + 1U);
  const auto late = static_cast<int32_t>(due - values_);
  if (late < -kMostOnTheWay || (count < kAtOnce && late > kMostOnTheWay)) return lose(hal);
  if (is_too_loud_) end(hal, SenseState::kTooLoud);
}

void CoilSense::lose(const Hal& hal) {
  stop_listening(hal);
  end(hal, SenseState::kLost);
}

// By pairs: some chips hand them over the wrong way round, which then changes nothing.
void CoilSense::take(uint16_t value) {
  if (stage_ == Stage::kListening && (value < kLowest || value > kHighest)) {
    is_too_loud_ = is_running() && static_cast<int32_t>(values_ / 2U - from_) >= 0;
  }
  const uint32_t now = values_++;
  if (now % 2U == 0) {
    first_of_pair_ = value;
  } else {
    take_pair(first_of_pair_ + value - 2 * kMiddle, now / 2U);
  }
}

void CoilSense::take_pair(int32_t pair, uint32_t now) {
  const bool is_own =
      is_running() && stage_ == Stage::kListening && static_cast<int32_t>(now - from_) >= 0;
  if (!is_own) return;
  found_.add(pair, step_u32_ * (now - phase_from_));
  if (found_.count() < request_.readings * f::kSensePairs) return;
  readings_[count_++] = {static_cast<uint8_t>(coil_), found_.in_phase_q5(), found_.quadrature_q5(),
                         found_.sum(), found_.squares_by_256()};
  ++coil_;
  stage_ = Stage::kToSelect;
}

void CoilSense::select_next(const Hal& hal, const Synthesis& synthesis) {
  if (coil_ == request_.playing) ++coil_;
  // Behind the last coil, where the first one plays.
  const bool is_reference = coil_ >= channels_ && request_.playing == 0 && !has_reference_;
  if (coil_ >= channels_ && !is_reference) {
    end(hal, SenseState::kDone);
    return;
  }
  if (is_reference) coil_ = expander::kReference;
  has_reference_ = is_reference;
  const auto awake =
      static_cast<uint8_t>(has_bridges_ ? 1U << request_.playing : uint32_t{expander::kAllAwake});
  are_awake_ = awake == expander::kAllAwake;
  if (!expander::set(hal, static_cast<uint8_t>(coil_), awake)) {
    end(hal, SenseState::kNoExpander);
    return;
  }
  found_.clear();
  const uint32_t settle_ms = count_ == 0 ? request_.settle_ms + kSettleMs : kSettleMs;
  from_ = ((synthesis.samples() - begun_at_) << sample_bits_) + pairs_in(settle_ms);
  stage_ = Stage::kListening;
}

}  // namespace chladni
