#include "table_partition.hpp"

#include "esp_partition.h"

namespace chladni::chip {

namespace {

// The first type that ESP-IDF leaves to applications.
constexpr auto kType = static_cast<esp_partition_type_t>(0x40);
constexpr auto kSubtype = static_cast<esp_partition_subtype_t>(0x00);
constexpr const char* kLabel = "tables";

const esp_partition_t* partition = nullptr;

}  // namespace

bool table_partition_open() {
  partition = esp_partition_find_first(kType, kSubtype, kLabel);
  return partition != nullptr;
}

bool table_partition_read(uint32_t offset, uint8_t* bytes, uint32_t count) {
  if (partition == nullptr) return false;
  return esp_partition_read(partition, offset, bytes, count) == ESP_OK;
}

}  // namespace chladni::chip
