// Lines of text over UART0.
#pragma once

#include "core/device.hpp"
#include "esp_err.h"

namespace chladni::chip {

esp_err_t console_start();

// Hand complete lines to the device; returns at once if there are none.
void console_poll(Device& device);

void console_print(const char* line);

}  // namespace chladni::chip
