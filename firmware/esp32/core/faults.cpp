#include "core/faults.hpp"

namespace chladni {

const char* to_text(FaultCause cause) {
  switch (cause) {
    case FaultCause::kReset: return "reset";
    case FaultCause::kNoTable: return "no table";
    case FaultCause::kTableRefused: return "table refused";
    case FaultCause::kConfigRefused: return "configuration refused";
    case FaultCause::kPanelMissing: return "panel missing";
    case FaultCause::kPanelFails: return "panel fails";
    case FaultCause::kPanelRange: return "panel out of range";
    case FaultCause::kTouchTimeout: return "touch timeout";
    case FaultCause::kTouchTooLong: return "touch too long";
    case FaultCause::kInterruptLate: return "interrupt late";
    case FaultCause::kUnderrun: return "stream underrun";
    case FaultCause::kHostSilent: return "host silent";
    case FaultCause::kCoilHot: return "coil hot";
    case FaultCause::kSupplyCurrent: return "supply current";
  }
  return "unknown";
}

}  // namespace chladni
