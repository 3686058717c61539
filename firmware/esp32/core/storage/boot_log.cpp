#include "core/storage/boot_log.hpp"

#include <array>

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

// A start: each clears bits of the one before, so that no erase is needed. A torn write counts as
// begun.
constexpr uint8_t kUnused = 0xFF, kBegun = 0x0F, kSettled = 0x00;
// An update, of which a torn one has the upper half as well; and a minute, which counts if whole.
constexpr uint8_t kUpdate = 0xF0, kMinute = 0xA0;
constexpr uint32_t kAtOnce = 64;

// What a sector that was full begins with if there were updates: this, their number, and a CRC.
constexpr uint32_t kMagic = 0x57484C43;  // "CLHW"
constexpr uint32_t kHeadBytes = 12;

}  // namespace

uint32_t BootLog::begin(const Hal& hal) {
  uint32_t row = 0;
  std::array<uint8_t, kAtOnce> bytes{};
  bool is_end = false;
  *this = BootLog{};
  for (uint32_t offset = 0; offset < kSectorBytes && !is_end; offset += kAtOnce) {
    if (!hal.read_flash(hal.context, FlashArea::kBoots, offset, bytes.data(), kAtOnce)) return 0;
    uint32_t first = 0;
    if (offset == 0 && read_u32(bytes.data()) == kMagic &&
        crc32(bytes.data(), 8) == read_u32(bytes.data() + 8)) {
      updates_ = read_u32(bytes.data() + 4);
      used_ = first = kHeadBytes;
    }
    for (uint32_t k = first; k < kAtOnce && !is_end; ++k) {
      is_end = bytes[k] == kUnused;
      if (is_end) continue;
      count(bytes[k], row);
      ++used_;
    }
  }
  is_there_ = true;
  if (used_ == kSectorBytes && !begin_again(hal)) return row;
  if (hal.program_flash(hal.context, FlashArea::kBoots, used_, &kBegun, 1)) at_ = used_++;
  return row;
}

void BootLog::count(uint8_t mark, uint32_t& row) {
  if (mark == kMinute) {
    owed_ -= owed_ > 0 ? 1U : 0U;
  } else if ((mark & kUpdate) == kUpdate) {
    ++updates_;
    owed_ += owed_ < kMostOwed ? 1U : 0U;
  } else {
    row = mark == kSettled ? 0 : row + 1;
  }
}

void BootLog::settle(const Hal& hal) {
  if (is_open()) hal.program_flash(hal.context, FlashArea::kBoots, at_, &kSettled, 1);
  at_ = kSectorBytes;
}

void BootLog::enter_update(const Hal& hal) { enter(hal, kUpdate); }
void BootLog::enter_minute(const Hal& hal) { enter(hal, kMinute); }

// What does not get there counts until the next start.
void BootLog::enter(const Hal& hal, uint8_t mark) {
  uint32_t row = 0;
  if (is_there_ && (used_ < kSectorBytes || begin_again(hal)) &&
      hal.program_flash(hal.context, FlashArea::kBoots, used_, &mark, 1)) {
    ++used_;
  }
  count(mark, row);
}

// The row of starts begins again with this one; a cut meanwhile forgets the updates as well.
bool BootLog::begin_again(const Hal& hal) {
  if (!hal.erase_sector(hal.context, FlashArea::kBoots, 0)) return false;
  const auto program = [&hal](uint32_t offset, const uint8_t* bytes, uint32_t count) {
    hal.program_flash(hal.context, FlashArea::kBoots, offset, bytes, count);
  };
  used_ = 0;
  if (updates_ > 0) {
    // Those that are owed come as marks again.
    std::array<uint8_t, kHeadBytes> head{};
    put_word(head.data(), kMagic, 4);
    put_word(head.data() + 4, updates_ - owed_, 4);
    put_word(head.data() + 8, crc32(head.data(), 8), 4);
    program(used_, head.data(), kHeadBytes);
    used_ += kHeadBytes;
    for (uint32_t k = 0; k < owed_; ++k) program(used_++, &kUpdate, 1);
  }
  if (!is_open()) return true;
  at_ = used_++;
  program(at_, &kBegun, 1);
  return true;
}

}  // namespace chladni
