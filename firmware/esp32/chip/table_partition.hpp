// The `tables` partition (partitions.csv), read through esp_partition.
#pragma once

#include <cstdint>

namespace chladni::chip {

// Find the partition; false if the partition table has none.
bool table_partition_open();

bool table_partition_read(uint32_t offset, uint8_t* bytes, uint32_t count);

}  // namespace chladni::chip
