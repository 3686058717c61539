#include "core/storage/files/stored_table.hpp"

namespace chladni {

using Status = link_format::Status;

// Whole and meant: what is wrong with it otherwise is for people to hear.
void StoredTable::load(const Hal& hal, uint32_t channels) {
  check_ = FlashCheck{};
  is_damaged_ = false;
  status_ = table_.load(hal, channels, updates_.find(hal));
}

TableStatus StoredTable::select(uint32_t frequency_millihertz) {
  if (!table_.is_loaded() || table_.is_intact()) return table_.select(frequency_millihertz);
  is_damaged_ = true;
  return status_ = TableStatus::kBadCrc;
}

bool StoredTable::check() {
  if (!check_.is_under_way() || check_.advance(table_.bytes()) == FlashCrc::kRight) return true;
  is_damaged_ = true;
  status_ = TableStatus::kBadCrc;
  return false;
}

Status StoredTable::check_head(const FlashWear& wear, const uint8_t* header, uint32_t total_bytes,
                               uint32_t table_crc, uint32_t channels, TableStatus& refused) const {
  const Status status = updates_.check_room(wear, total_bytes, table_crc);
  if (status != Status::kOk) return status;
  refused = Table::check_head(header, total_bytes, channels);
  return refused == TableStatus::kOk ? Status::kOk : Status::kRefused;
}

Status StoredTable::commit(const Hal& hal, FlashWear& wear, uint32_t channels) {
  return updates_.commit(hal, wear, [&](uint32_t offset) {
    return table_.load(hal, channels, offset) == TableStatus::kOk;
  });
}

Status StoredTable::restore_other(const Hal& hal, FlashWear& wear, uint32_t channels) {
  return updates_.restore_other(hal, wear, [&](uint32_t offset) {
    return table_.load(hal, channels, offset) == TableStatus::kOk;
  });
}

}  // namespace chladni
