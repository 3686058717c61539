// The partitions that are the device's own (partitions.csv), through esp_partition.
#pragma once

#include <cstdint>

#include "core/hal.hpp"

namespace chladni::chip {

// Find them and map the tables; false if the partition table lacks tables or config, or has too
// little for tables.
bool flash_open();

bool flash_read(FlashArea area, uint32_t offset, uint8_t* bytes, uint32_t count);
// Bytes of the tables where they lie; null for other areas and beyond the partition's end.
const uint8_t* flash_map(FlashArea area, uint32_t offset, uint32_t count);
// These two stall the tasks of both cores; the sample interrupt goes on.
bool flash_erase_sector(FlashArea area, uint32_t offset);
bool flash_program(FlashArea area, uint32_t offset, const uint8_t* bytes, uint32_t count);

}  // namespace chladni::chip
