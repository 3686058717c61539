// The link and the console over the chip's wire.
#pragma once

#include "core/link/link.hpp"
#include "esp_err.h"

namespace chladni::chip {

esp_err_t console_start();
// Another rate than the ROM's, once what was printed is out.
void console_set_baud(uint32_t baud);

// Hand what has come to the link; returns at once if that is nothing.
void console_poll(Link& link);

void console_print(const char* line);
void console_send(const uint8_t* bytes, uint32_t count);

}  // namespace chladni::chip
