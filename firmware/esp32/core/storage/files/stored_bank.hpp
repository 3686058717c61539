// The effect bank in use: loaded from flash, replaced by a host's update, and checked again and
// again. A device may be without.
#pragma once

#include <cstdint>

#include "core/effects/bank.hpp"
#include "core/generated/link_format.hpp"
#include "core/storage/files/slot_updates.hpp"
#include "core/storage/flash_wear.hpp"
#include "core/table/flash_check.hpp"

namespace chladni {

class StoredBank {
 public:
  // The newest whole bank in flash; what was under way is given up.
  void load(const Hal& hal) {
    check_ = FlashCheck{};
    status_ = bank_.load(hal, updates_.find(hal));
  }

  // As of the table (stored_table.hpp); one that is damaged is not read any more.
  void begin_check(uint32_t now_ms) {
    check_.begin(now_ms, bank_.is_loaded() ? bank_.total_bytes() : 0);
  }
  bool check() {
    if (!check_.is_under_way() || check_.advance(bank_.bytes()) == FlashCrc::kRight) return true;
    bank_.clear();
    status_ = BankStatus::kBadCrc;
    return false;
  }

  // An update. What its header refuses is refused before anything is erased.
  link_format::Status check_head(const Hal& hal, const FlashWear& wear, const uint8_t* header,
                                 uint32_t total_bytes, uint32_t bank_crc,
                                 BankStatus& refused) const;
  link_format::Status commit(const Hal& hal, FlashWear& wear);
  SlotUpdates& updates() { return updates_; }

  const Bank& bank() const { return bank_; }
  BankStatus status() const { return status_; }
  const SlotStore& store() const { return updates_.store(); }

 private:
  Bank bank_;
  BankStatus status_ = BankStatus::kNone;
  SlotUpdates updates_{kBankSlots};
  FlashCheck check_;
};

}  // namespace chladni
