#include "core/storage/files/stored_bank.hpp"

namespace chladni {

using Status = link_format::Status;

Status StoredBank::check_head(const Hal& hal, const FlashWear& wear, const uint8_t* header,
                              uint32_t total_bytes, uint32_t bank_crc, BankStatus& refused) const {
  const bool has_flash = hal.map_flash(hal.context, FlashArea::kEffects, 0, 1) != nullptr;
  if (!has_flash) return Status::kNoPartition;
  const Status status = updates_.check_room(wear, total_bytes, bank_crc);
  if (status != Status::kOk) return status;
  refused = Bank::check_head(header, total_bytes);
  return refused == BankStatus::kOk ? Status::kOk : Status::kRefused;
}

Status StoredBank::commit(const Hal& hal, FlashWear& wear) {
  return updates_.commit(
      hal, wear, [&](uint32_t offset) { return bank_.load(hal, offset) == BankStatus::kOk; });
}

}  // namespace chladni
