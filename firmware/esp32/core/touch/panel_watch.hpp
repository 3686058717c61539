// What the panel does wrong, noted once.
#pragma once

#include <cstdint>

#include "core/base/fault_log.hpp"
#include "core/generated/config_format.hpp"
#include "core/touch/touch_input.hpp"

namespace chladni {

class PanelWatch {
 public:
  void start(const Config& config) {
    *this = PanelWatch{};
    health_ = config.panel == 0 ? PanelHealth::kNone : PanelHealth::kFine;
  }
  // After the panel was asked.
  void look(const TouchInput& input, FaultLog& faults, uint32_t now_ms);

 private:
  // As it was at the last look.
  PanelHealth health_ = PanelHealth::kNone;
  uint32_t out_of_range_ = 0;
};

}  // namespace chladni
