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
const esp_partition_t* effects = nullptr;
const uint8_t* mapped_tables = nullptr;
const uint8_t* mapped_effects = nullptr;

const esp_partition_t* partition_of(FlashArea area) {
  switch (area) {
    case FlashArea::kTables: return tables;
    case FlashArea::kConfig: return config;
    case FlashArea::kBoots: return boots;
    case FlashArea::kEffects: return effects;
    case FlashArea::kNetwork: break;
  }
  return network;
}

// Once and for good: the driver drops what the cache holds of it after every write. The partition
// begins anywhere in a page of 64 KiB, which the driver allows for.
const uint8_t* mapped(const esp_partition_t* partition, uint32_t least_bytes) {
  if (partition == nullptr || partition->size < least_bytes) return nullptr;
  const void* found = nullptr;
  esp_partition_mmap_handle_t handle = 0;
  const esp_err_t done =
      esp_partition_mmap(partition, 0, partition->size, ESP_PARTITION_MMAP_DATA, &found, &handle);
  return done == ESP_OK ? static_cast<const uint8_t*>(found) : nullptr;
}

}  // namespace

bool flash_open() {
  tables = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x00), "tables");
  config = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x01), "config");
  // A device that was partitioned before there were these does without them.
  network = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x02), "network");
  boots = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x03), "boots");
  effects = esp_partition_find_first(kType, static_cast<esp_partition_subtype_t>(0x04), "effects");
  mapped_tables = mapped(tables, store_format::kTablePartitionBytes);
  mapped_effects = mapped(effects, store_format::kBankPartitionBytes);
  return config != nullptr && mapped_tables != nullptr;
}

bool flash_read(FlashArea area, uint32_t offset, uint8_t* bytes, uint32_t count) {
  const esp_partition_t* const partition = partition_of(area);
  return partition != nullptr && esp_partition_read(partition, offset, bytes, count) == ESP_OK;
}

const uint8_t* flash_map(FlashArea area, uint32_t offset, uint32_t count) {
  const uint8_t* const begin = area == FlashArea::kTables    ? mapped_tables
                               : area == FlashArea::kEffects ? mapped_effects
                                                             : nullptr;
  if (begin == nullptr) return nullptr;
  const uint32_t size = partition_of(area)->size;
  return offset <= size && count <= size - offset ? begin + offset : nullptr;
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
