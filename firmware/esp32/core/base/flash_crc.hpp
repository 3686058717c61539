// The CRC-32 that closes what lies in flash: tables and configurations end in their own.
#pragma once

#include <cstdint>

#include "core/hal.hpp"

namespace chladni {

enum class FlashCrc : uint8_t { kRight, kWrong, kReadFailed };

// Reads `total` bytes, more than four, of which the last four are the CRC of those before; `crc` is
// what those before have.
FlashCrc check_flash_crc(const Hal& hal, FlashArea area, uint32_t offset, uint32_t total,
                         uint32_t& crc);

}  // namespace chladni
