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
  // After a brown-out a finger could bring the next one, and the next; whoever sits at a host sees
  // it.
  static void trust_host(FaultLog& faults);
  // Each turn: a start that lasts is entered as one, while nothing plays.
  void settle(const Hal& hal, uint32_t now_ms, bool is_quiet);

  void ask_restart(uint32_t now_ms) { asked_ms_ = now_ms; }
  // Outputs may take their ramp, but nothing keeps a restart off for long.
  bool is_restart_due(uint32_t now_ms, bool is_quiet) const;

 private:
  BootLog boots_;
  uint32_t asked_ms_ = 0;
};

}  // namespace chladni
