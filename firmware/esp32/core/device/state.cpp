#include "core/device/state.hpp"

namespace chladni {

const char* to_text(DeviceEvent event) {
  switch (event) {
    case DeviceEvent::kTouchBegins: return "touch begins";
    case DeviceEvent::kTouchEnds: return "touch ends";
    case DeviceEvent::kStreamBegins: return "stream begins";
    case DeviceEvent::kStreamEnds: return "stream ends";
    case DeviceEvent::kUpdateBegins: return "update begins";
    case DeviceEvent::kUpdateEnds: return "update ends";
    case DeviceEvent::kFaultArises: return "fault arises";
    case DeviceEvent::kFaultClears: return "fault clears";
    case DeviceEvent::kFingerLifts: return "finger lifts";
    case DeviceEvent::kRestartAsked: return "restart asked";
  }
  return "unknown";
}

}  // namespace chladni
