#include "core/storage/stored_table.hpp"

namespace chladni {

namespace {

using Status = link_format::Status;

Status to_link(StoreStatus status) {
  switch (status) {
    case StoreStatus::kOk: return Status::kOk;
    case StoreStatus::kTooLarge: return Status::kTooLarge;
    case StoreStatus::kNotBegun: return Status::kNotBegun;
    case StoreStatus::kWrongOffset: return Status::kWrongOffset;
    case StoreStatus::kFlashFailed: return Status::kFlashFailed;
    case StoreStatus::kRefused: return Status::kRefused;
    case StoreStatus::kNoOther: return Status::kNoOther;
  }
  return Status::kMalformed;
}

}  // namespace

void StoredTable::load(const Hal& hal, uint32_t channels) {
  store_.abandon();
  check_ = FlashCheck{};
  is_damaged_ = false;
  status_ = store_.load(hal, table_, channels);
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
  if (total_bytes == 0 || total_bytes > store_format::kTrailerOffset) return Status::kTooLarge;
  if (!wear.may_write() && !store_.has_part(total_bytes, table_crc)) return Status::kTooOften;
  refused = Table::check_head(header, total_bytes, channels);
  return refused == TableStatus::kOk ? Status::kOk : Status::kRefused;
}

Status StoredTable::begin(const Hal& hal, FlashWear& wear, uint32_t total_bytes,
                          uint32_t table_crc) {
  is_paid_ = is_paid_ && store_.has_part(total_bytes, table_crc);
  const StoreStatus status = store_.begin(hal, total_bytes, table_crc);
  if (status != StoreStatus::kOk || !store_.must_erase()) return to_link(status);
  wear.spend(hal);
  is_paid_ = true;
  return to_link(store_.erase_slot(hal));
}

Status StoredTable::write(const Hal& hal, uint32_t offset, const uint8_t* bytes, uint32_t count) {
  return to_link(store_.write(hal, offset, bytes, count));
}

// What was there already is a switch of tables, whose trailer is full some time.
Status StoredTable::commit(const Hal& hal, FlashWear& wear, uint32_t channels) {
  if (store_.must_enter() && !is_paid_) {
    if (!wear.may_write()) return Status::kTooOften;
    wear.spend(hal);
  }
  is_paid_ = false;
  return to_link(store_.commit(hal, table_, channels));
}

Status StoredTable::restore_other(const Hal& hal, FlashWear& wear, uint32_t channels) {
  if (store_.has_other(hal)) wear.spend(hal);
  return to_link(store_.restore_other(hal, table_, channels));
}

}  // namespace chladni
