#include "core/sensing/coil_sense.hpp"

#include "core/generated/link_format.hpp"
#include "core/sensing/expander.hpp"
#include "core/storage/config.hpp"

namespace chladni {

namespace {

namespace f = link_format;

// 80 MHz / 4096 / 488, of which what is played is a multiple.
constexpr uint32_t kPeriodValues = 2U * f::kSenseValues;
constexpr uint32_t kUnitMillihertz = 40023;
// 2^32 by that many values, and what is left of it.
constexpr uint32_t kUnitStep = 2200290, kUnitRest = 1216;
static_assert(static_cast<uint64_t>(kUnitStep) * kPeriodValues + kUnitRest == uint64_t{1} << 32);
// From one coil to the next: the multiplexer's input, and what the converter has not handed out.
constexpr uint32_t kSettleMs = 3;
// The converter goes on for so long after a request.
constexpr uint32_t kSilenceMs = f::kTouchSilenceMs;
constexpr uint32_t kRetryMs = 250;
constexpr int32_t kMiddle = 2048;
constexpr uint16_t kHighest = 4095;
constexpr uint32_t kAtOnce = 128;
// Values of a turn: eight times as many as come in its millisecond.
constexpr uint32_t kMostInTurn = 640;

constexpr uint32_t values_in(uint32_t milliseconds) { return milliseconds * 78125U / 1000U; }

}  // namespace

void CoilSense::start(const Config& config, uint32_t now_ms) {
  woken_ms_ = now_ms - kRetryMs;  // at once
  is_wired_ = has_sensing_pin(config) && config.panel != 0;
  has_bridges_ = config.driver == kBridge;
  channels_ = config.channels;
  sample_bits_ = config.pwm_bits - 8U;
}

void CoilSense::ask(const SenseRequest& request, uint32_t now_ms) {
  request_ = request;
  asked_ms_ = now_ms;
  step_u32_ = request.multiple * kUnitStep +
              (request.multiple * kUnitRest + kPeriodValues / 2U) / kPeriodValues;
  state_ = SenseState::kRunning;
  stage_ = Stage::kToPlay;
  is_too_loud_ = false;
  count_ = 0;
  coil_ = 0;
}

uint32_t CoilSense::frequency_millihertz() const { return request_.multiple * kUnitMillihertz; }

void CoilSense::note_play(uint32_t amplitude_q16) {
  amplitude_q16_ = amplitude_q16;
  stage_ = Stage::kToBegin;
}

void CoilSense::turn(const Hal& hal, const Synthesis& synthesis, uint32_t now_ms) {
  if (!is_wired_) return;
  if (!is_running()) {
    if (is_listening_ && now_ms - asked_ms_ >= kSilenceMs) stop_listening(hal);
    if (!are_awake_ && now_ms - woken_ms_ >= kRetryMs) wake_all(hal, now_ms);
  }
  if (is_listening_) read(hal);
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

void CoilSense::end(const Hal& hal, SenseState state) {
  if (!is_running()) return;
  state_ = state;
  are_awake_ = expander::set(hal, 0, expander::kAllAwake);
}

// After a start nothing is known of the expander, which may have been left by another one.
void CoilSense::wake_all(const Hal& hal, uint32_t now_ms) {
  woken_ms_ = now_ms;
  are_awake_ = expander::set(hal, 0, expander::kAllAwake);
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

void CoilSense::read(const Hal& hal) {
  std::array<uint16_t, kAtOnce> values;
  for (uint32_t done = 0; done < kMostInTurn; done += kAtOnce) {
    const uint32_t count = hal.heard(hal.context, values.data(), kAtOnce);
    if (count == kValuesLost) {
      stop_listening(hal);
      end(hal, SenseState::kLost);
      return;
    }
    for (uint32_t k = 0; k < count; ++k) take(values[k]);
    if (is_too_loud_) end(hal, SenseState::kTooLoud);
    if (count < kAtOnce || !is_listening_) break;
  }
}

void CoilSense::take(uint16_t value) {
  const uint32_t now = values_++;
  const bool is_own =
      is_running() && stage_ == Stage::kListening && static_cast<int32_t>(now - from_) >= 0;
  if (!is_own) return;
  if (value == 0 || value >= kHighest) is_too_loud_ = true;
  found_.add(value - kMiddle, step_u32_ * (now - phase_from_));
  if (found_.count() < request_.readings * f::kSenseValues) return;
  readings_[count_++] = {static_cast<uint8_t>(coil_), found_.in_phase_q5(), found_.quadrature_q5(),
                         found_.sum(), found_.squares_by_256()};
  ++coil_;
  stage_ = Stage::kToSelect;
}

void CoilSense::select_next(const Hal& hal, const Synthesis& synthesis) {
  if (coil_ == request_.playing) ++coil_;
  if (coil_ == channels_ && request_.playing == 0) coil_ = expander::kReference;
  if (coil_ >= channels_ && coil_ != expander::kReference) {
    end(hal, SenseState::kDone);
    return;
  }
  const auto awake =
      static_cast<uint8_t>(has_bridges_ ? 1U << request_.playing : uint32_t{expander::kAllAwake});
  are_awake_ = awake == expander::kAllAwake;
  if (!expander::set(hal, static_cast<uint8_t>(coil_), awake)) {
    end(hal, SenseState::kNoExpander);
    return;
  }
  found_.clear();
  const uint32_t settle_ms = count_ == 0 ? request_.settle_ms + kSettleMs : kSettleMs;
  from_ = ((synthesis.samples() - begun_at_) << sample_bits_) + values_in(settle_ms);
  stage_ = Stage::kListening;
}

}  // namespace chladni
