#include "core/storage/files/slot_store.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

namespace f = store_format;

constexpr uint32_t kAtMagic = table_format::kAtMagic, kAtTotalBytes = table_format::kAtTotalBytes,
                   kHeadBytes = kAtTotalBytes + 4U, kCrcBytes = 4;

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
    case StoreStatus::kTooLarge: return "too large for a slot";
    case StoreStatus::kNotBegun: return "no update under way";
    case StoreStatus::kWrongOffset: return "bytes out of order";
    case StoreStatus::kFlashFailed: return "flash failed";
    case StoreStatus::kRefused: return "not for this device";
    case StoreStatus::kNoOther: return "none in the other slot";
  }
  return "unknown";
}

bool SlotStore::is_whole(const Hal& hal, uint32_t slot, uint32_t& crc) const {
  const uint8_t* const head = map(hal, slot, 0, kHeadBytes);
  if (head == nullptr || read_u32(head + kAtMagic) != kind_.magic) return false;
  const uint32_t total = read_u32(head + kAtTotalBytes);
  if (total < kind_.smallest || total > kind_.largest) return false;
  const uint8_t* const file = map(hal, slot, 0, total);
  if (file == nullptr) return false;
  const uint32_t covered = total - kCrcBytes;
  crc = crc32(file, covered);
  return read_u32(file + covered) == crc;
}

SlotStore::Trailer SlotStore::trailer_of(const Hal& hal, uint32_t slot, uint32_t file_crc) const {
  const uint32_t last_entry = kind_.slot_bytes - f::kEntryBytes;
  Trailer found;
  found.end = kind_.trailer_offset();
  const uint8_t* entry = map(hal, slot, kind_.trailer_offset(), kSectorBytes);
  for (uint32_t at = kind_.trailer_offset(); entry != nullptr && at <= last_entry;
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
    if (read_u32(entry + f::kAtFileCrc) != file_crc) continue;
    if (!found.is_entered || is_after(sequence, found.sequence)) found.sequence = sequence;
    found.is_entered = true;
  }
  return found;
}

uint32_t SlotStore::find(const Hal& hal) {
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
  return begin_of(slot_);
}

StoreStatus SlotStore::begin(const Hal& hal, uint32_t total_bytes, uint32_t file_crc) {
  is_updating_ = false;
  if (total_bytes == 0 || total_bytes > kind_.trailer_offset()) return StoreStatus::kTooLarge;
  const uint32_t target = other();
  must_erase_ = false;
  if (has_part(total_bytes, file_crc)) {
    // The same that broke off: it goes on where it ended, and its CRC tells whether that was right.
    is_updating_ = true;
    return StoreStatus::kOk;
  }
  has_part_ = false;
  total_bytes_ = total_bytes;
  file_crc_ = file_crc;
  // What is there already is not written again: flash wears, and the other table stays.
  for (const uint32_t slot : {slot_, target}) {
    uint32_t crc = 0;
    if (slot >= f::kSlots || !is_whole(hal, slot, crc) || crc != file_crc) continue;
    target_ = slot;
    next_offset_ = total_bytes;
    is_updating_ = true;
    return StoreStatus::kOk;
  }
  target_ = target;
  must_erase_ = true;
  return StoreStatus::kOk;
}

StoreStatus SlotStore::erase_slot(const Hal& hal) {
  must_erase_ = false;
  for (uint32_t done = 0; done < total_bytes_; done += kSectorBytes) {
    const uint32_t offset = begin_of(target_) + done;
    if (!erase(hal, offset)) return StoreStatus::kFlashFailed;
  }
  is_updating_ = has_part_ = true;
  next_offset_ = 0;
  return StoreStatus::kOk;
}

StoreStatus SlotStore::write(const Hal& hal, uint32_t offset, const uint8_t* bytes,
                             uint32_t count) {
  if (!is_updating_) return StoreStatus::kNotBegun;
  // Sent twice, because the answer was lost, or there from before.
  if (offset <= next_offset_ && count <= next_offset_ - offset) return StoreStatus::kOk;
  if (offset != next_offset_ || count > total_bytes_ - offset) return StoreStatus::kWrongOffset;
  if (!hal.program_flash(hal.context, kind_.area, begin_of(target_) + offset, bytes, count)) {
    is_updating_ = has_part_ = false;
    return StoreStatus::kFlashFailed;
  }
  next_offset_ += count;
  return StoreStatus::kOk;
}

// Flash has been seen to answer OK and write nothing.
StoreStatus SlotStore::read_back(const Hal& hal) {
  if (!is_updating_ || next_offset_ != total_bytes_) return StoreStatus::kNotBegun;
  is_updating_ = has_part_ = false;
  uint32_t crc = 0;
  const bool is_right = is_whole(hal, target_, crc) && crc == file_crc_;
  return is_right ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

StoreStatus SlotStore::enter_update(const Hal& hal) {
  if (target_ == slot_ && !is_older_) return StoreStatus::kOk;
  // A file that counted without an entry gets one, so that there is a way back to it.
  uint32_t current = 0;
  if (slot_ < f::kSlots && is_whole(hal, slot_, current) &&
      !trailer_of(hal, slot_, current).is_entered && !enter(hal, slot_, current)) {
    return StoreStatus::kFlashFailed;
  }
  return enter(hal, target_, file_crc_) ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

bool SlotStore::has_other(const Hal& hal) const {
  uint32_t crc = 0;
  // What was sent whole and never committed is no file to go back to.
  return slot_ < f::kSlots && is_whole(hal, other(), crc) &&
         trailer_of(hal, other(), crc).is_entered;
}

StoreStatus SlotStore::enter_other(const Hal& hal) {
  uint32_t crc = 0;
  const bool is_there = is_whole(hal, other(), crc) && enter(hal, other(), crc);
  return is_there ? StoreStatus::kOk : StoreStatus::kFlashFailed;
}

bool SlotStore::erase(const Hal& hal, uint32_t offset) {
  ++erases_;
  return hal.erase_sector(hal.context, kind_.area, offset);
}

// From now on the slot's file is the one that counts.
bool SlotStore::enter(const Hal& hal, uint32_t slot, uint32_t file_crc) {
  Trailer own = trailer_of(hal, slot, file_crc);
  const Trailer other = trailer_of(hal, 1U - slot, file_crc);
  const bool is_others = other.has_entry && (!own.has_entry || is_after(other.newest, own.newest));
  const uint32_t sequence = (is_others ? other.newest : own.newest) + 1U;
  if (own.end > kind_.slot_bytes - f::kEntryBytes) {
    // Full. A cut before the next entry leaves the other slot's file, which counts now.
    own.end = kind_.trailer_offset();
    const uint32_t trailer = begin_of(slot) + own.end;
    if (!erase(hal, trailer)) return false;
  }
  std::array<uint8_t, f::kEntryBytes> entry{};
  put_word(&entry[f::kAtSequence], sequence, 4);
  put_word(&entry[f::kAtFileCrc], file_crc, 4);
  put_word(&entry[f::kAtEntryCrc], crc32(entry.data(), f::kAtEntryCrc), 4);
  const uint32_t offset = begin_of(slot) + own.end;
  if (!hal.program_flash(hal.context, kind_.area, offset, entry.data(), f::kEntryBytes)) {
    return false;
  }
  const Trailer entered = trailer_of(hal, slot, file_crc);
  return entered.is_entered && entered.sequence == sequence;
}

}  // namespace chladni
