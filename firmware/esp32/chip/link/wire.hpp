// The wire of console and link, whatever the chip has: esp32/wire.cpp, esp32s3/wire.cpp.
#pragma once

#include <cstddef>
#include <cstdint>

#include "esp_err.h"

namespace chladni::chip {

// A frame that comes while a sector is erased, and the one behind it; an answer with the faults.
constexpr int kReceiveBytes = 4096, kSendBytes = 1024;

esp_err_t wire_start();

// Bits per second, where the wire has any, once what was sent is out.
void wire_set_baud(uint32_t baud);

// What has come, without waiting; how many bytes, 0 or less for none.
int wire_read(uint8_t* bytes, uint32_t count);

void wire_write(const void* bytes, size_t count);

}  // namespace chladni::chip
