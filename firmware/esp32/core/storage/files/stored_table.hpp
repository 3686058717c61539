// The table in use: loaded from flash, replaced by a host's update, and checked again and again.
#pragma once

#include <cstdint>

#include "core/generated/link_format.hpp"
#include "core/storage/files/slot_updates.hpp"
#include "core/storage/flash_wear.hpp"
#include "core/table/flash_check.hpp"
#include "core/table/table.hpp"

namespace chladni {

class StoredTable {
 public:
  // The newest whole table in flash; what was under way is given up.
  void load(const Hal& hal, uint32_t channels);
  // Use the drives of another frequency. kBadCrc if the table has been damaged meanwhile.
  TableStatus select(uint32_t frequency_millihertz);
  // It is whole, but asks for what the outputs cannot do.
  void refuse() { status_ = TableStatus::kBadField; }

  // Each turn: one pass over the table a minute, a little of it at a time. A pass is due, and
  // begins; whether the bytes it has come to are still right.
  bool is_check_due(uint32_t now_ms) const { return check_.is_due(now_ms, kCheckEveryMs); }
  void begin_check(uint32_t now_ms) {
    check_.begin(now_ms, table_.is_loaded() ? table_.total_bytes() : 0);
  }
  bool check();
  // A bit has flipped; to be loaded again once nothing plays.
  bool is_damaged() const { return is_damaged_; }

  // An update. What its header refuses is refused before anything is erased: that must not cost the
  // table to go back to. `commit` and `restore_other` try a table out: `load` comes next.
  link_format::Status check_head(const FlashWear& wear, const uint8_t* header, uint32_t total_bytes,
                                 uint32_t table_crc, uint32_t channels, TableStatus& refused) const;
  link_format::Status commit(const Hal& hal, FlashWear& wear, uint32_t channels);
  link_format::Status restore_other(const Hal& hal, FlashWear& wear, uint32_t channels);
  SlotUpdates& updates() { return updates_; }

  const Table& table() const { return table_; }
  TableStatus status() const { return status_; }
  const SlotStore& store() const { return updates_.store(); }

 private:
  static constexpr uint32_t kCheckEveryMs = 60000;

  Table table_;
  TableStatus status_ = TableStatus::kNone;
  bool is_damaged_ = false;
  SlotUpdates updates_{kTableSlots};
  FlashCheck check_;
};

}  // namespace chladni
