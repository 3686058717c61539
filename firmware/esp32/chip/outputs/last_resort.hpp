// Outputs go off before anything else when the firmware ends: panic, both watchdogs' panics,
// brown-out and restart. What no code sees (the RTC watchdog, a power cut) resets the whole chip.
#pragma once

#include "esp_err.h"

namespace chladni::chip {

// Hook brown-out and restart; the panic handler is hooked by the linker (CMakeLists.txt).
esp_err_t last_resort_arm();

}  // namespace chladni::chip
