// Tables in flash: two slots, and a journal that says which of them counts.
//
// An update goes to the slot that is not in use, is read back whole, and then entered into the
// journal with one short write. Until that write is complete the old table counts, after it the new
// one; a cut at any byte leaves one of the two. Journal entries are appended; when a sector is
// full the other one is erased, so that the newest entry is never in what is being erased.
#pragma once

#include <cstdint>

#include "core/generated/store_format.hpp"
#include "core/hal.hpp"
#include "core/table.hpp"

namespace chladni {

enum class StoreStatus : uint8_t {
  kOk,
  kTooLarge,     // more bytes than a slot has
  kNotBegun,     // no update is under way
  kWrongOffset,  // bytes must come in order: `next_offset` says which are due
  kFlashFailed,  // erasing, writing or reading back went wrong; the old table stays
  kRefused,      // what was written is no table for this device; the old one stays
  kNoOther,      // the other slot holds no whole table
};

const char* to_text(StoreStatus status);

class TableStore {
 public:
  // Load the newest whole table; a table that was written to the first slot without an entry (by
  // the ROM's loader) counts if no entry does.
  TableStatus load(const Hal& hal, Table& table, uint32_t channels);

  // The slot of what was loaded last; kSlots if nothing was.
  uint32_t slot() const { return slot_; }

  // An update of so many bytes that end in `table_crc`, in order, and its end. A cut in between
  // costs the update only. `commit` and `restore_other` try a table out in `table`: whatever they
  // answer, `load` comes next, and gives what a start would.
  StoreStatus begin(const Hal& hal, uint32_t total_bytes, uint32_t table_crc);
  StoreStatus write(const Hal& hal, uint32_t offset, const uint8_t* bytes, uint32_t count);
  StoreStatus commit(const Hal& hal, Table& table, uint32_t channels);
  // Back to what the other slot holds.
  StoreStatus restore_other(const Hal& hal, Table& table, uint32_t channels);

  // What is under way is given up; nothing of it counts.
  void abandon() { is_updating_ = false; }
  bool is_updating() const { return is_updating_; }
  uint32_t next_offset() const { return next_offset_; }

 private:
  struct Entry {
    uint32_t sequence;
    uint32_t slot;
    uint32_t table_crc;
    uint32_t offset;  // in the partition
  };

  static bool read_entry(const Hal& hal, uint32_t offset, Entry& entry);
  // The newest entry before `limit`; any if there is none yet.
  static bool newest(const Hal& hal, const Entry* limit, Entry& entry);
  static bool is_entered(const Hal& hal, uint32_t slot, uint32_t table_crc);
  static bool crc_of(const Hal& hal, uint32_t slot, uint32_t& crc);
  static uint32_t end_of_entries(const Hal& hal, uint32_t sector);
  static bool append(const Hal& hal, uint32_t slot, uint32_t table_crc);

  uint32_t slot_ = store_format::kSlots;
  bool is_updating_ = false;
  bool has_part_ = false;  // of the table that is described below, up to `next_offset_`
  uint32_t target_ = 0;
  uint32_t total_bytes_ = 0;
  uint32_t table_crc_ = 0;
  uint32_t next_offset_ = 0;
};

}  // namespace chladni
