// Tables in flash: two slots, each with a trailer that says when its table came to count.
//
// An update goes to the slot that is not in use, is read back whole, and then entered into that
// slot's trailer with one short write, under a number one higher than any before. Until that write
// is complete the old table counts, after it the new one; a cut at any byte leaves one of the two.
// An entry names its table's CRC, so it says nothing about what is written over that table later.
#pragma once

#include <cstdint>

#include "core/generated/store_format.hpp"
#include "core/hal.hpp"
#include "core/table/table.hpp"

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
  // Load the whole table that was entered last; a table that was written to the first slot without
  // an entry (by the ROM's loader) counts if no entry does.
  TableStatus load(const Hal& hal, Table& table, uint32_t channels);

  // The slot of what was loaded last; kSlots if nothing was.
  uint32_t slot() const { return slot_; }
  // Whether a newer one was entered, which is damaged.
  bool is_older() const { return is_older_; }

  // An update of so many bytes that end in `table_crc`, in order, and its end. A cut in between
  // costs the update only. `commit` and `restore_other` try a table out in `table`: whatever they
  // answer, `load` comes next, and gives what a start would.
  StoreStatus begin(const Hal& hal, uint32_t total_bytes, uint32_t table_crc);
  // Before the first `write`, where `begin` has found nothing of the table in flash.
  bool must_erase() const { return must_erase_; }
  StoreStatus erase_slot(const Hal& hal);
  StoreStatus write(const Hal& hal, uint32_t offset, const uint8_t* bytes, uint32_t count);
  StoreStatus commit(const Hal& hal, Table& table, uint32_t channels);
  // Whether all has come, and a `commit` changes which table counts.
  bool must_enter() const {
    return is_updating_ && next_offset_ == total_bytes_ && (target_ != slot_ || is_older_);
  }
  // Back to what the other slot holds, if that is a table that counted once.
  bool has_other(const Hal& hal) const;
  StoreStatus restore_other(const Hal& hal, Table& table, uint32_t channels);

  // What is under way is given up; nothing of it counts.
  void abandon() { is_updating_ = false; }
  bool is_updating() const { return is_updating_; }
  // Whether the same update broke off, and goes on.
  bool has_part(uint32_t total_bytes, uint32_t table_crc) const {
    return has_part_ && target_ != slot_ && total_bytes == total_bytes_ && table_crc == table_crc_;
  }
  // Sectors, since start.
  uint32_t erases() const { return erases_; }
  uint32_t next_offset() const { return next_offset_; }

 private:
  // What a slot's trailer says of a table.
  struct Trailer {
    bool is_entered = false;  // it came to count once
    uint32_t sequence = 0;    // when, for the last time
    bool has_entry = false;   // of any table
    uint32_t newest = 0;      // the highest number among those
    bool is_damaged = false;  // an entry that was whole once is not
    uint32_t end = 0;         // offset in the slot behind everything written
  };

  // Whether a slot holds a table with the right CRC, and which.
  static bool is_whole(const Hal& hal, uint32_t slot, uint32_t& crc);
  static Trailer trailer_of(const Hal& hal, uint32_t slot, uint32_t table_crc);
  bool enter(const Hal& hal, uint32_t slot, uint32_t table_crc);
  bool erase(const Hal& hal, uint32_t offset);

  uint32_t slot_ = store_format::kSlots;
  bool is_older_ = false;
  uint32_t erases_ = 0;
  bool is_updating_ = false;
  bool must_erase_ = false;
  bool has_part_ = false;  // of the table that is described below, up to `next_offset_`
  uint32_t target_ = 0;
  uint32_t total_bytes_ = 0;
  uint32_t table_crc_ = 0;
  uint32_t next_offset_ = 0;
};

}  // namespace chladni
