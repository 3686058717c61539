#include "core/touch/panel_watch.hpp"

namespace chladni {

void PanelWatch::look(const TouchInput& input, FaultLog& faults, uint32_t now_ms) {
  const PanelHealth health = input.health();
  if (health != health_) {
    health_ = health;
    if (health == PanelHealth::kMissing) faults.add(FaultCause::kPanelMissing, 0, now_ms);
    if (health == PanelHealth::kWedged) {
      faults.add(FaultCause::kPanelFails, input.bus_errors(), now_ms);
    }
  }
  if (input.out_of_range() == out_of_range_) return;
  out_of_range_ = input.out_of_range();
  // A panel that goes on like this must not push everything else out of the log.
  const uint32_t kept = faults.kept();
  if (kept == 0 || faults.at(kept - 1U).cause != FaultCause::kPanelRange) {
    faults.add(FaultCause::kPanelRange, out_of_range_, now_ms);
  }
}

}  // namespace chladni
