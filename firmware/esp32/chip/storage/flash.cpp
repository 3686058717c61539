#include "storage/flash.hpp"

#include "core/generated/store_format.hpp"
#include "esp_partition.h"
#include "esp_task_wdt.h"

namespace chladni::chip {

namespace {

// The first type that ESP-IDF leaves to applications.
constexpr auto kType = static_cast<esp_partition_type_t>(0x40);

const esp_partition_t* tables = nullptr;
const esp_partition_t* config = nullptr;
const esp_partition_t* network = nullptr;
const esp_partition_t* boots = nullptr;
const uint8_t* mapped_tables = nullptr;

const esp_partition_t* partition_of(FlashArea area) {
  switch (area) {
    case FlashArea::kTables: return tables;
    case FlashArea::kConfig: return config;
    case FlashArea::kBoots: return boots;
    case FlashArea::kNetwork: break;
  }
  return network;
}

}  // namespace

bool flash_open() {
  tables = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x00), "tables");
  config = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x01), "config");
  // A device that was partitioned before there were these does without them.
  network = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x02), "network");
  boots = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x03), "boots");
  if (tables == nullptr || config == nullptr) return false;
  if (tables->size < store_format::kTablePartitionBytes) return false;
  // Mapped once and for good: the driver drops what the cache holds of it after every write. The
  // partition begins anywhere in a page of 64 KiB, which the driver allows for.
  const void* mapped = nullptr;
  esp_partition_mmap_handle_t handle = 0;
  if (esp_partition_mmap(tables, 0, tables->size, ESP_PARTITION_MMAP_DATA, &mapped, &handle) !=
      ESP_OK) {
    return false;
  }
  mapped_tables = static_cast<const uint8_t*>(mapped);
  return true;
}

bool flash_read(FlashArea area, uint32_t offset, uint8_t* bytes, uint32_t count) {
  const esp_partition_t* const partition = partition_of(area);
  return partition != nullptr && esp_partition_read(partition, offset, bytes, count) == ESP_OK;
}

const uint8_t* flash_map(FlashArea area, uint32_t offset, uint32_t count) {
  if (area != FlashArea::kTables || mapped_tables == nullptr) return nullptr;
  const bool is_inside = offset <= tables->size && count <= tables->size - offset;
  return is_inside ? mapped_tables + offset : nullptr;
}

bool flash_erase_sector(FlashArea area, uint32_t offset) {
  // Many in a row may take longer than the watchdog waits, and each of them is a sign of life.
  esp_task_wdt_reset();
  const esp_partition_t* const partition = partition_of(area);
  return partition != nullptr &&
         esp_partition_erase_range(partition, offset, kSectorBytes) == ESP_OK;
}

bool flash_program(FlashArea area, uint32_t offset, const uint8_t* bytes, uint32_t count) {
  const esp_partition_t* const partition = partition_of(area);
  return partition != nullptr && esp_partition_write(partition, offset, bytes, count) == ESP_OK;
}

}  // namespace chladni::chip
