#include "core/device/starts.hpp"

#include "core/storage/retained.hpp"

namespace chladni {

namespace {

// A start that lasts so long was no part of a row.
constexpr uint32_t kSettledMs = 10000;
// One that lasts so long after a crash has nothing to do with it.
constexpr uint32_t kWellMs = 600000;
// From a restart's request: an answer's time on a wire or a network; and the longest ramp.
constexpr uint32_t kRestartMs = 50, kLatestRestartMs = 1500;

}  // namespace

void Starts::begin(const Hal& hal, FaultLog& faults) {
  cause_ = hal.reset_cause(hal.context);
  has_crashed_ = cause_ == ResetCause::kPanic || cause_ == ResetCause::kWatchdog;
  const auto detail = static_cast<uint32_t>(cause_);
  if (cause_ != ResetCause::kPowerOn) faults.add(FaultCause::kReset, detail, 0);
  if (cause_ == ResetCause::kBrownOut) faults.raise(FaultCause::kBrownOut, 0, 0);
  crashes_ = count_crash(hal, has_crashed_);
  if (!is_bare()) {
    if (hal.open_flash != nullptr) hal.open_flash(hal.context);
    row_ = boots_.begin(hal);
  }
  const uint32_t in_a_row = crashes_ > row_ ? crashes_ : row_;
  if (in_a_row >= kMostInARow) faults.raise(FaultCause::kShortStarts, in_a_row, 0);
}

bool Starts::may_start_network(FaultLog& faults) const {
  const bool is_held = has_crashed_ || cause_ == ResetCause::kBrownOut || row_ >= kMostInARow;
  if (is_held) faults.raise(FaultCause::kNetworkHeld, static_cast<uint32_t>(cause_), 0);
  return !is_held;
}

void Starts::trust_host(FaultLog& faults) {
  faults.clear(FaultCause::kBrownOut);
  faults.clear(FaultCause::kShortStarts);
}

void Starts::settle(const Hal& hal, uint32_t now_ms, bool is_quiet) {
  if (boots_.is_open() && now_ms >= kSettledMs && is_quiet) boots_.settle(hal);
  if (crashes_ > 0 && now_ms >= kWellMs && !is_wire_only()) {
    crashes_ = 0;
    forget_crashes(hal);
  }
}

bool Starts::is_restart_due(uint32_t now_ms, bool is_quiet) const {
  const uint32_t passed_ms = now_ms - asked_ms_;
  return passed_ms >= kRestartMs && (is_quiet || passed_ms >= kLatestRestartMs);
}

void Starts::restart(const Hal& hal, bool is_quiet) {
  if (is_quiet) boots_.settle(hal);
  forget_crashes(hal);
  hal.restart(hal.context);
}

}  // namespace chladni
