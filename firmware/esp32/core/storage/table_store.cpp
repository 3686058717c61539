#include "core/storage/table_store.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

namespace f = store_format;

constexpr uint32_t kLastEntry = f::kSlotBytes - f::kEntryBytes;

const uint8_t* map(const Hal& hal, uint32_t slot, uint32_t offset, uint32_t count) {
  return hal.map_flash(hal.context, FlashArea::kTables, slot * f::kSlotBytes + offset, count);
}

bool is_blank(const uint8_t* entry) {
  for (uint32_t k = 0; k < f::kEntryBytes; ++k) {
    if (entry[k] != 0xFF) return false;
  }
  return true;
}

// Whether `a` comes after `b`; numbers may wrap around.
bool is_after(uint32_t a, uint32_t b) { return static_cast<int32_t>(a - b) > 0; }

}  // namespace

const char* to_text(StoreStatus status) {
  switch (status) {
    case StoreStatus::kOk: return "ok";
    case StoreStatus::kTooLarge: return "table too large for a slot";
    case StoreStatus::kNotBegun: return "no update under way";
    case StoreStatus::kWrongOffset: return "bytes out of order";
    case StoreStatus::kFlashFailed: return "flash failed";
    case StoreStatus::kRefused: return "no table for this device";
    case StoreStatus::kNoOther: return "no other table";
  }
  return "unknown";
}

bool TableStore::is_whole(const Hal& hal, uint32_t slot, uint32_t& crc) {
  namespace t = table_format;
  const uint8_t* const head = map(hal, slot, 0, t::kHeaderBytes);
  if (head == nullptr || read_u32(head + t::kAtMagic) != t::kMagic) return false;
  const uint32_t total = read_u32(head + t::kAtTotalBytes);
  if (total < t::kSmallestFile || total > t::kLargestFile) return false;
  const uint8_t* const table = map(hal, slot, 0, total);
  if (table == nullptr) return false;
  const uint32_t covered = total - t::kCrcBytes;
  crc = crc32(table, covered);
  return read_u32(table + covered) == crc;
}

TableStore::Trailer TableStore::trailer_of(const Hal& hal, uint32_t slot, uint32_t table_crc) {
  Trailer found;
  found.end = f::kTrailerOffset;
  const uint8_t* entry = map(hal, slot, f::kTrailerOffset, kSectorBytes);
  for (uint32_t at = f::kTrailerOffset; entry != nullptr && at <= kLastEntry;
       at += f::kEntryBytes, entry += f::kEntryBytes) {
    if (is_blank(entry)) continue;
    found.end = at + f::kEntryBytes;
    if (crc32(entry, f::kAtEntryCrc) != read_u32(entry + f::kAtEntryCrc)) {
      // What a cut tears has no last byte.
      found.is_damaged = found.is_damaged || entry[f::kEntryBytes - 1U] != 0xFF;
      continue;
    }
    const uint32_t sequence = read_u32(entry + f::kAtSequence);
    if (!found.has_entry || is_after(sequence, found.newest)) found.newest = sequence;
    found.has_entry = true;
    if (read_u32(entry + f::kAtTableCrc) != table_crc) continue;
    if (!found.is_entered || is_after(sequence, found.sequence)) found.sequence = sequence;
    found.is_entered = true;
  }
  return found;
}

TableStatus TableStore::load(const Hal& hal, Table& table, uint32_t channels) {
  std::array<bool, f::kSlots> is_there{};
  std::array<Trailer, f::kSlots> trailers{};
  for (uint32_t slot = 0; slot < f::kSlots; ++slot) {
    uint32_t crc = 0;
    is_there[slot] = is_whole(hal, slot, crc);
    trailers[slot] = trailer_of(hal, slot, is_there[slot] ? crc : 0U);
    trailers[slot].is_entered = trailers[slot].is_entered && is_there[slot];
  }
  const Trailer &first = trailers[0], &second = trailers[1];
  if (first.is_entered || second.is_entered) {
    const bool is_newer = is_after(second.sequence, first.sequence);
    slot_ = second.is_entered && (is_newer || !first.is_entered) ? 1U : 0U;
  } else {
    // Of two that are not whole the one that was entered last says what is wrong.
    const bool is_second =
        second.has_entry && (!first.has_entry || is_after(second.newest, first.newest));
    slot_ = !is_there[0] && (is_there[1] || is_second) ? 1U : 0U;
  }
  const Trailer &own = trailers[slot_], &other = trailers[1U - slot_];
  const uint32_t counts = own.is_entered ? own.sequence : 0U;
  is_older_ = (own.has_entry && is_after(own.newest, counts)) ||
              (other.has_entry && is_after(other.newest, counts)) || own.is_damaged ||
              other.is_damaged;
  // Whole and meant: what is wrong with it otherwise is for people to hear.
  return table.load(hal, channels, slot_ * f::kSlotBytes);
}

StoreStatus TableStore::begin(const Hal& hal, uint32_t total_bytes, uint32_t table_crc) {
  is_updating_ = false;
  if (total_bytes == 0 || total_bytes > f::kTrailerOffset) return StoreStatus::kTooLarge;
  const uint32_t target = slot_ == 0 ? 1U : 0U;
  must_erase_ = false;
  if (has_part(total_bytes, table_crc)) {
    // The same that broke off: it goes on where it ended, and its CRC tells whether that was right.
    is_updating_ = true;
    return StoreStatus::kOk;
  }
  has_part_ = false;
  total_bytes_ = total_bytes;
  table_crc_ = table_crc;
  // What is there already is not written again: flash wears, and the other table stays.
  for (const uint32_t slot : {slot_, target}) {
    uint32_t crc = 0;
    if (slot >= f::kSlots || !is_whole(hal, slot, crc) || crc != table_crc) continue;
    target_ = slot;
    next_offset_ = total_bytes;
    is_updating_ = true;
    return StoreStatus::kOk;
  }
  target_ = target;
  must_erase_ = true;
  return StoreStatus::kOk;
}

StoreStatus TableStore::erase_slot(const Hal& hal) {
  must_erase_ = false;
  for (uint32_t done = 0; done < total_bytes_; done += kSectorBytes) {
    const uint32_t offset = target_ * f::kSlotBytes + done;
    if (!erase(hal, offset)) return StoreStatus::kFlashFailed;
  }
  is_updating_ = has_part_ = true;
  next_offset_ = 0;
  return StoreStatus::kOk;
}

StoreStatus TableStore::write(const Hal& hal, uint32_t offset, const uint8_t* bytes,
                              uint32_t count) {
  if (!is_updating_) return StoreStatus::kNotBegun;
  // Sent twice, because the answer was lost, or there from before.
  if (offset <= next_offset_ && count <= next_offset_ - offset) return StoreStatus::kOk;
  if (offset != next_offset_ || count > total_bytes_ - offset) return StoreStatus::kWrongOffset;
  const uint32_t at = target_ * f::kSlotBytes + offset;
  if (!hal.program_flash(hal.context, FlashArea::kTables, at, bytes, count)) {
    is_updating_ = has_part_ = false;
    return StoreStatus::kFlashFailed;
  }
  next_offset_ += count;
  return StoreStatus::kOk;
}

StoreStatus TableStore::commit(const Hal& hal, Table& table, uint32_t channels) {
  if (!is_updating_ || next_offset_ != total_bytes_) return StoreStatus::kNotBegun;
  is_updating_ = has_part_ = false;
  // Read back: flash has been seen to answer OK and write nothing.
  uint32_t crc = 0, current = 0;
  if (!is_whole(hal, target_, crc) || crc != table_crc_) return StoreStatus::kFlashFailed;
  if (table.load(hal, channels, target_ * f::kSlotBytes) != TableStatus::kOk) {
    return StoreStatus::kRefused;
  }
  if (target_ == slot_ && !is_older_) return StoreStatus::kOk;
  // A table that played without an entry gets one, so that there is a way back to it.
  if (slot_ < f::kSlots && is_whole(hal, slot_, current) &&
      !trailer_of(hal, slot_, current).is_entered && !enter(hal, slot_, current)) {
    return StoreStatus::kFlashFailed;
  }
  return enter(hal, target_, crc) ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

bool TableStore::has_other(const Hal& hal) const {
  const uint32_t other = slot_ == 0 ? 1U : 0U;
  uint32_t crc = 0;
  // What was sent whole and never committed is no table to go back to.
  return slot_ < f::kSlots && is_whole(hal, other, crc) && trailer_of(hal, other, crc).is_entered;
}

StoreStatus TableStore::restore_other(const Hal& hal, Table& table, uint32_t channels) {
  const uint32_t other = slot_ == 0 ? 1U : 0U;
  uint32_t crc = 0;
  is_updating_ = false;
  if (!has_other(hal) || !is_whole(hal, other, crc)) return StoreStatus::kNoOther;
  if (table.load(hal, channels, other * f::kSlotBytes) != TableStatus::kOk) {
    return StoreStatus::kRefused;
  }
  return enter(hal, other, crc) ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

bool TableStore::erase(const Hal& hal, uint32_t offset) {
  ++erases_;
  return hal.erase_sector(hal.context, FlashArea::kTables, offset);
}

// From now on the slot's table is the one that counts.
bool TableStore::enter(const Hal& hal, uint32_t slot, uint32_t table_crc) {
  Trailer own = trailer_of(hal, slot, table_crc);
  const Trailer other = trailer_of(hal, 1U - slot, table_crc);
  const bool is_others = other.has_entry && (!own.has_entry || is_after(other.newest, own.newest));
  const uint32_t sequence = (is_others ? other.newest : own.newest) + 1U;
  if (own.end > kLastEntry) {
    // Full. A cut before the next entry leaves the other slot's table, which counts now.
    own.end = f::kTrailerOffset;
    const uint32_t trailer = slot * f::kSlotBytes + own.end;
    if (!erase(hal, trailer)) return false;
  }
  std::array<uint8_t, f::kEntryBytes> entry{};
  put_word(&entry[f::kAtSequence], sequence, 4);
  put_word(&entry[f::kAtTableCrc], table_crc, 4);
  put_word(&entry[f::kAtEntryCrc], crc32(entry.data(), f::kAtEntryCrc), 4);
  const uint32_t offset = slot * f::kSlotBytes + own.end;
  if (!hal.program_flash(hal.context, FlashArea::kTables, offset, entry.data(), f::kEntryBytes)) {
    return false;
  }
  const Trailer entered = trailer_of(hal, slot, table_crc);
  return entered.is_entered && entered.sequence == sequence;
}

}  // namespace chladni
