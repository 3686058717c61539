// Lines of text that a person types at the device's console, and what they print.
#pragma once

#include "core/device/device.hpp"

namespace chladni {

// One line, in the main loop; "help", or any line that makes no sense, prints what there is.
// Returns how many bytes it has printed.
uint32_t run_command(Device& device, const char* line);

}  // namespace chladni
