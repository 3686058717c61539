// The sample interrupt: every fourth carrier period, in the middle of one.
#pragma once

#include "core/device/device.hpp"
#include "esp_err.h"

namespace chladni::chip {

// Call `device.sample` from an interrupt on the calling core, from now on. The interrupt runs with
// the flash cache off, so `device` must lie in internal RAM. The PWM must be running.
esp_err_t sample_timer_start(Device& device);

}  // namespace chladni::chip
