#include "core/device/starts.hpp"

namespace chladni {

namespace {

// A start that lasts so long was no part of a row; more in a row than that are a supply's fault.
constexpr uint32_t kSettledMs = 10000, kMostInARow = 4;
// From a restart's request: an answer's time on a wire or a network; and the longest ramp.
constexpr uint32_t kRestartMs = 50, kLatestRestartMs = 1500;

}  // namespace

void Starts::begin(const Hal& hal, FaultLog& faults) {
  const ResetCause cause = hal.reset_cause(hal.context);
  if (cause != ResetCause::kPowerOn)
    faults.add(FaultCause::kReset, static_cast<uint32_t>(cause), 0);
  if (cause == ResetCause::kBrownOut) faults.raise(FaultCause::kBrownOut, 0, 0);
  const uint32_t row = cause == ResetCause::kPowerOn ? boots_.begin(hal) : 0U;
  if (row >= kMostInARow) faults.raise(FaultCause::kPowerOns, row, 0);
}

void Starts::trust_host(FaultLog& faults) {
  faults.clear(FaultCause::kBrownOut);
  faults.clear(FaultCause::kPowerOns);
}

void Starts::settle(const Hal& hal, uint32_t now_ms, bool is_quiet) {
  if (boots_.is_open() && now_ms >= kSettledMs && is_quiet) boots_.settle(hal);
}

bool Starts::is_restart_due(uint32_t now_ms, bool is_quiet) const {
  const uint32_t passed_ms = now_ms - asked_ms_;
  return passed_ms >= kRestartMs && (is_quiet || passed_ms >= kLatestRestartMs);
}

}  // namespace chladni
