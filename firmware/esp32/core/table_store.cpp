#include "core/table_store.hpp"

#include "core/bytes.hpp"
#include "core/crc32.hpp"
#include "core/flash_crc.hpp"

namespace chladni {

namespace {

namespace f = store_format;

constexpr uint32_t kEntriesPerSector = kSectorBytes / f::kEntryBytes;

bool read(const Hal& hal, uint32_t offset, uint8_t* bytes, uint32_t count) {
  return hal.read_flash(hal.context, FlashArea::kTables, offset, bytes, count);
}

uint32_t journal_sector(uint32_t sector) { return f::kJournalOffset + sector * kSectorBytes; }

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

bool TableStore::read_entry(const Hal& hal, uint32_t offset, Entry& entry) {
  std::array<uint8_t, f::kEntryBytes> bytes{};
  if (!read(hal, offset, bytes.data(), f::kEntryBytes)) return false;
  const uint32_t crc = crc32(bytes.data(), f::kAtEntryCrc);
  entry = {read_u32(&bytes[f::kAtSequence]), read_u32(&bytes[f::kAtSlot]),
           read_u32(&bytes[f::kAtTableCrc]), offset};
  return read_u32(&bytes[f::kAtEntryCrc]) == crc && entry.slot < f::kSlots;
}

bool TableStore::newest(const Hal& hal, const Entry* limit, Entry& entry) {
  bool has_any = false;
  for (uint32_t sector = 0; sector < f::kJournalSectors; ++sector) {
    for (uint32_t k = 0; k < kEntriesPerSector; ++k) {
      Entry found{};
      if (!read_entry(hal, journal_sector(sector) + k * f::kEntryBytes, found)) continue;
      if (limit != nullptr && !is_after(limit->sequence, found.sequence)) continue;
      if (has_any && !is_after(found.sequence, entry.sequence)) continue;
      entry = found;
      has_any = true;
    }
  }
  return has_any;
}

// Whether a slot's table was ever made to count.
bool TableStore::is_entered(const Hal& hal, uint32_t slot, uint32_t table_crc) {
  for (uint32_t k = 0; k < f::kJournalSectors * kEntriesPerSector; ++k) {
    Entry found{};
    if (read_entry(hal, f::kJournalOffset + k * f::kEntryBytes, found) && found.slot == slot &&
        found.table_crc == table_crc) {
      return true;
    }
  }
  return false;
}

// The last four bytes of what a slot holds, if they are the right ones for the rest.
bool TableStore::crc_of(const Hal& hal, uint32_t slot, uint32_t& crc) {
  namespace t = table_format;
  const uint32_t base = slot * f::kSlotBytes;
  std::array<uint8_t, t::kAtTotalBytes + 4U> head{};
  if (!read(hal, base, head.data(), head.size())) return false;
  const uint32_t total = read_u32(&head[t::kAtTotalBytes]);
  if (read_u32(&head[t::kAtMagic]) != t::kMagic) return false;
  if (total < t::kHeaderBytes + t::kCrcBytes || total > f::kSlotBytes) return false;
  return check_flash_crc(hal, FlashArea::kTables, base, total, crc) == FlashCrc::kRight;
}

TableStatus TableStore::load(const Hal& hal, Table& table, uint32_t channels) {
  std::array<bool, f::kSlots> is_whole{};
  std::array<uint32_t, f::kSlots> crcs{};
  for (uint32_t slot = 0; slot < f::kSlots; ++slot) is_whole[slot] = crc_of(hal, slot, crcs[slot]);
  slot_ = f::kSlots;
  Entry entry{}, older{};
  // Two of them: what is looked for must not change what it has to be older than.
  for (bool has = newest(hal, nullptr, entry); has;
       has = newest(hal, &entry, older), entry = older) {
    if (!is_whole[entry.slot] || crcs[entry.slot] != entry.table_crc) continue;
    // Whole and meant: what is wrong with it otherwise is for people to hear.
    slot_ = entry.slot;
    return table.load(hal, channels, slot_ * f::kSlotBytes);
  }
  slot_ = !is_whole[0] && is_whole[1] ? 1U : 0U;
  return table.load(hal, channels, slot_ * f::kSlotBytes);
}

StoreStatus TableStore::begin(const Hal& hal, uint32_t total_bytes, uint32_t table_crc) {
  is_updating_ = false;
  if (total_bytes == 0 || total_bytes > f::kSlotBytes) return StoreStatus::kTooLarge;
  const uint32_t target = slot_ == 0 ? 1U : 0U;
  if (has_part_ && target == target_ && total_bytes == total_bytes_ && table_crc == table_crc_) {
    // The same that broke off: it goes on where it ended, and its CRC tells whether that was right.
    is_updating_ = true;
    return StoreStatus::kOk;
  }
  has_part_ = false;
  target_ = target;
  for (uint32_t done = 0; done < total_bytes; done += kSectorBytes) {
    const uint32_t offset = target_ * f::kSlotBytes + done;
    if (!hal.erase_sector(hal.context, FlashArea::kTables, offset))
      return StoreStatus::kFlashFailed;
  }
  is_updating_ = has_part_ = true;
  total_bytes_ = total_bytes;
  table_crc_ = table_crc;
  next_offset_ = 0;
  return StoreStatus::kOk;
}

StoreStatus TableStore::write(const Hal& hal, uint32_t offset, const uint8_t* bytes,
                              uint32_t count) {
  if (!is_updating_) return StoreStatus::kNotBegun;
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
  uint32_t crc = 0;
  if (!crc_of(hal, target_, crc) || crc != table_crc_) return StoreStatus::kFlashFailed;
  if (table.load(hal, channels, target_ * f::kSlotBytes) != TableStatus::kOk) {
    return StoreStatus::kRefused;
  }
  // A table that played without an entry gets one, so that there is a way back to it.
  Entry any{};
  uint32_t current = 0;
  const bool is_first = slot_ < f::kSlots && !newest(hal, nullptr, any);
  if (is_first && crc_of(hal, slot_, current) && !append(hal, slot_, current)) {
    return StoreStatus::kFlashFailed;
  }
  return append(hal, target_, crc) ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

StoreStatus TableStore::restore_other(const Hal& hal, Table& table, uint32_t channels) {
  const uint32_t other = slot_ == 0 ? 1U : 0U;
  uint32_t crc = 0;
  is_updating_ = false;
  // What was sent whole and never committed is no table to go back to.
  if (slot_ >= f::kSlots || !crc_of(hal, other, crc) || !is_entered(hal, other, crc)) {
    return StoreStatus::kNoOther;
  }
  if (table.load(hal, channels, other * f::kSlotBytes) != TableStatus::kOk) {
    return StoreStatus::kRefused;
  }
  return append(hal, other, crc) ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

// The first cell behind everything that was ever written to a sector, torn or not.
uint32_t TableStore::end_of_entries(const Hal& hal, uint32_t sector) {
  uint32_t end = 0;
  for (uint32_t k = 0; k < kEntriesPerSector; ++k) {
    std::array<uint8_t, f::kEntryBytes> bytes{};
    const uint32_t offset = journal_sector(sector) + k * f::kEntryBytes;
    bool is_blank = read(hal, offset, bytes.data(), f::kEntryBytes);
    for (const uint8_t byte : bytes) is_blank = is_blank && byte == 0xFF;
    if (!is_blank) end = k + 1U;
  }
  return end;
}

bool TableStore::append(const Hal& hal, uint32_t slot, uint32_t table_crc) {
  Entry last{};
  const bool has_last = newest(hal, nullptr, last);
  uint32_t sector = has_last ? (last.offset - f::kJournalOffset) / kSectorBytes : 0U;
  uint32_t cell = end_of_entries(hal, sector);
  // A full sector, or one full of rubbish, is left for the other, which holds nothing newer.
  if (cell >= kEntriesPerSector || (!has_last && cell > 0)) {
    sector = has_last ? 1U - sector : 0U;
    if (!hal.erase_sector(hal.context, FlashArea::kTables, journal_sector(sector))) return false;
    cell = 0;
  }
  std::array<uint8_t, f::kEntryBytes> bytes{};
  const uint32_t sequence = has_last ? last.sequence + 1U : 1U;
  put_word(&bytes[f::kAtSequence], sequence, 4);
  put_word(&bytes[f::kAtSlot], slot, 4);
  put_word(&bytes[f::kAtTableCrc], table_crc, 4);
  put_word(&bytes[f::kAtEntryCrc], crc32(bytes.data(), f::kAtEntryCrc), 4);
  const uint32_t offset = journal_sector(sector) + cell * f::kEntryBytes;
  if (!hal.program_flash(hal.context, FlashArea::kTables, offset, bytes.data(), f::kEntryBytes)) {
    return false;
  }
  Entry written{};
  return read_entry(hal, offset, written) && written.sequence == sequence;
}

}  // namespace chladni
