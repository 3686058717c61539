#include "core/storage/files/slot_updates.hpp"

namespace chladni {

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

Status SlotUpdates::check_room(const FlashWear& wear, uint32_t total_bytes,
                               uint32_t file_crc) const {
  if (total_bytes == 0 || total_bytes > largest_) return Status::kTooLarge;
  const bool may_write = wear.may_write() || store_.has_part(total_bytes, file_crc);
  return may_write ? Status::kOk : Status::kTooOften;
}

Status SlotUpdates::begin(const Hal& hal, FlashWear& wear, uint32_t total_bytes,
                          uint32_t file_crc) {
  is_paid_ = is_paid_ && store_.has_part(total_bytes, file_crc);
  const StoreStatus status = store_.begin(hal, total_bytes, file_crc);
  if (status != StoreStatus::kOk || !store_.must_erase()) return to_link(status);
  wear.spend(hal);
  is_paid_ = true;
  return to_link(store_.erase_slot(hal));
}

// What was there already is a switch of files, whose trailer is full some time.
Status SlotUpdates::pay_for_entry(const Hal& hal, FlashWear& wear) {
  if (store_.must_enter() && !is_paid_) {
    if (!wear.may_write()) return Status::kTooOften;
    wear.spend(hal);
  }
  is_paid_ = false;
  return Status::kOk;
}

}  // namespace chladni
