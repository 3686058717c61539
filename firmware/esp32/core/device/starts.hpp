// Why the device has started, whether this start lasts, and when it starts again.
#pragma once

#include <cstdint>

#include "core/base/fault_log.hpp"
#include "core/hal.hpp"
#include "core/storage/boot_log.hpp"

namespace chladni {

class Starts {
 public:
  // What keeps outputs off after a supply that gave way stands in `faults` from now on.
  void begin(const Hal& hal, FaultLog& faults);
  // Whether the radio may have ended the last start, or what draws half an ampere could end this
  // one. It is noted, if there is a network to start.
  bool may_start_network(FaultLog& faults) const;
  // After crashes in a row, or as many with no good while between them, nothing is begun but the
  // wire, so that it answers whatever the cause is.
  bool is_wire_only() const {
    return has_crashed_ && (row_ >= kMostInARow || crashes_ >= kMostInARow);
  }
  // If that crashes as well, flash stays shut: the device answers as a blank one.
  bool is_bare() const { return has_crashed_ && crashes_ >= kMostWithFlash; }
  // After a brown-out a finger could bring the next one, and the next; whoever sits at a host sees
  // it.
  static void trust_host(FaultLog& faults);
  // What starts and updates are entered into.
  BootLog& log() { return boots_; }
  // Each turn: a start that lasts is entered as one, while nothing plays. Crashes are forgotten
  // once the device has run well for longer.
  void settle(const Hal& hal, uint32_t now_ms, bool is_quiet);

  void ask_restart(uint32_t now_ms) { asked_ms_ = now_ms; }
  // Outputs may take their ramp, but nothing keeps a restart off for long.
  bool is_restart_due(uint32_t now_ms, bool is_quiet) const;
  // A start that ends because someone asked is no part of a row.
  void restart(const Hal& hal, bool is_quiet);

 private:
  // More starts in a row that did not last are the fault of a supply, or of the firmware.
  static constexpr uint32_t kMostInARow = 4;
  static constexpr uint32_t kMostWithFlash = 2 * kMostInARow;

  BootLog boots_;
  ResetCause cause_ = ResetCause::kPowerOn;
  bool has_crashed_ = false;
  uint32_t row_ = 0;      // starts before this one that did not last
  uint32_t crashes_ = 0;  // however long the starts lasted
  uint32_t asked_ms_ = 0;
};

}  // namespace chladni
