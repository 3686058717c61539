// The sample interrupt: every fourth carrier period, in the middle of one.
#pragma once

#include "core/device/device.hpp"
#include "esp_err.h"

namespace chladni::chip {

// Call `device.sample` from an interrupt on the calling core, from now on. The interrupt runs with
// the flash cache off, so `device` must lie in internal RAM. The PWM must be running.
esp_err_t sample_timer_start(Device& device);

// From the main loop, each turn: look where in the carrier period duties were written, and move the
// timer if that was near its end, where they are taken over. What the interrupt takes to come is in
// it. ESP_ERR_INVALID_STATE where eight moves in a row did not do.
esp_err_t sample_timer_keep_aligned();

}  // namespace chladni::chip
