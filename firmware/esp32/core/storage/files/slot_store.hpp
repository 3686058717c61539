// A kind of file in flash, a drive table or an effect bank: two slots, each with a trailer that
// says when its file came to count.
//
// An update goes to the slot that is not in use, is read back whole, and then entered into that
// slot's trailer with one short write, under a number one higher than any before. Until that write
// is complete the old file counts, after it the new one; a cut at any byte leaves one of the two.
// An entry names its file's CRC, so it says nothing about what is written over that file later.
#pragma once

#include <cstdint>

#include "core/generated/bank_format.hpp"
#include "core/generated/store_format.hpp"
#include "core/generated/table_format.hpp"
#include "core/hal.hpp"

namespace chladni {

enum class StoreStatus : uint8_t {
  kOk,
  kTooLarge,     // more bytes than a slot has
  kNotBegun,     // no update is under way
  kWrongOffset,  // bytes must come in order: `next_offset` says which are due
  kFlashFailed,  // erasing, writing or reading back went wrong; the old file stays
  kRefused,      // what was written is no file for this device; the old one stays
  kNoOther,      // the other slot holds no whole file
};

const char* to_text(StoreStatus status);

// Where slots lie, and what files begin with: a magic word, and after four more bytes their size.
// The last four bytes are the CRC of those before.
struct SlotKind {
  FlashArea area;
  uint32_t slot_bytes;
  uint32_t magic;
  uint32_t smallest;
  uint32_t largest;

  constexpr uint32_t trailer_offset() const { return slot_bytes - kSectorBytes; }
};

constexpr SlotKind kTableSlots{FlashArea::kTables, store_format::kTableSlotBytes,
                               table_format::kMagic, table_format::kSmallestFile,
                               table_format::kLargestFile};
static_assert(table_format::kLargestFile == kTableSlots.trailer_offset());
constexpr SlotKind kBankSlots{FlashArea::kEffects, store_format::kBankSlotBytes,
                              bank_format::kMagic, bank_format::kSmallestFile,
                              bank_format::kLargestFile};
static_assert(bank_format::kLargestFile == kBankSlots.trailer_offset());
static_assert(bank_format::kAtTotalBytes == table_format::kAtTotalBytes);

class SlotStore {
 public:
  explicit constexpr SlotStore(const SlotKind& kind) : kind_(kind) {}

  // Find the whole file that was entered last; one that was written to the first slot without
  // an entry (by the ROM's loader) counts if no entry does. Where it begins in the area.
  uint32_t find(const Hal& hal);

  // The slot that was found last; kSlots before.
  uint32_t slot() const { return slot_; }
  // Whether a newer one was entered, which is damaged.
  bool is_older() const { return is_older_; }

  // An update of so many bytes that end in `file_crc`, in order, and its end. A cut in between
  // costs the update only. `commit` and `restore_other` ask `accepts(offset)` whether the device
  // can use the file that lies there: whatever they answer, `find` comes next, and gives what a
  // start would.
  StoreStatus begin(const Hal& hal, uint32_t total_bytes, uint32_t file_crc);
  // Before the first `write`, where `begin` has found nothing of the file in flash.
  bool must_erase() const { return must_erase_; }
  StoreStatus erase_slot(const Hal& hal);
  StoreStatus write(const Hal& hal, uint32_t offset, const uint8_t* bytes, uint32_t count);
  template <typename Accepts>
  StoreStatus commit(const Hal& hal, const Accepts& accepts) {
    const StoreStatus status = read_back(hal);
    if (status != StoreStatus::kOk) return status;
    return accepts(begin_of(target_)) ? enter_update(hal) : StoreStatus::kRefused;
  }
  // Whether all has come, and a `commit` changes which file counts.
  bool must_enter() const {
    return is_updating_ && next_offset_ == total_bytes_ && (target_ != slot_ || is_older_);
  }
  // Back to what the other slot holds, if that is a file that counted once.
  bool has_other(const Hal& hal) const;
  template <typename Accepts>
  StoreStatus restore_other(const Hal& hal, const Accepts& accepts) {
    is_updating_ = false;
    if (!has_other(hal)) return StoreStatus::kNoOther;
    return accepts(begin_of(other())) ? enter_other(hal) : StoreStatus::kRefused;
  }

  // What is under way is given up; nothing of it counts.
  void abandon() { is_updating_ = false; }
  bool is_updating() const { return is_updating_; }
  // Whether the same update broke off, and goes on.
  bool has_part(uint32_t total_bytes, uint32_t file_crc) const {
    return has_part_ && target_ != slot_ && total_bytes == total_bytes_ && file_crc == file_crc_;
  }
  // Sectors, since start.
  uint32_t erases() const { return erases_; }
  uint32_t next_offset() const { return next_offset_; }

 private:
  // What a slot's trailer says of a file.
  struct Trailer {
    bool is_entered = false;  // it came to count once
    uint32_t sequence = 0;    // when, for the last time
    bool has_entry = false;   // of any file
    uint32_t newest = 0;      // the highest number among those
    bool is_damaged = false;  // an entry that was whole once is not
    uint32_t end = 0;         // offset in the slot behind everything written
  };

  uint32_t begin_of(uint32_t slot) const { return slot * kind_.slot_bytes; }
  uint32_t other() const { return slot_ == 0 ? 1U : 0U; }
  const uint8_t* map(const Hal& hal, uint32_t slot, uint32_t offset, uint32_t count) const {
    return hal.map_flash(hal.context, kind_.area, begin_of(slot) + offset, count);
  }
  // Whether a slot holds a file with the right CRC, and which.
  bool is_whole(const Hal& hal, uint32_t slot, uint32_t& crc) const;
  Trailer trailer_of(const Hal& hal, uint32_t slot, uint32_t file_crc) const;
  StoreStatus read_back(const Hal& hal);
  StoreStatus enter_update(const Hal& hal);
  StoreStatus enter_other(const Hal& hal);
  bool enter(const Hal& hal, uint32_t slot, uint32_t file_crc);
  bool erase(const Hal& hal, uint32_t offset);

  SlotKind kind_;
  uint32_t slot_ = store_format::kSlots;
  bool is_older_ = false;
  uint32_t erases_ = 0;
  bool is_updating_ = false;
  bool must_erase_ = false;
  bool has_part_ = false;  // of the file that is described below, up to `next_offset_`
  uint32_t target_ = 0;
  uint32_t total_bytes_ = 0;
  uint32_t file_crc_ = 0;
  uint32_t next_offset_ = 0;
};

}  // namespace chladni
