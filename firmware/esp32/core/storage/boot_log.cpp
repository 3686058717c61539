#include "core/storage/boot_log.hpp"

#include <array>

namespace chladni {

namespace {

// Each clears bits of the one before, so that no erase is needed. A torn write counts as begun.
constexpr uint8_t kUnused = 0xFF, kBegun = 0x0F, kSettled = 0x00;
constexpr uint32_t kAtOnce = 64;

}  // namespace

uint32_t BootLog::begin(const Hal& hal) {
  uint32_t row = 0, used = 0;
  std::array<uint8_t, kAtOnce> bytes{};
  bool is_end = false;
  for (uint32_t offset = 0; offset < kSectorBytes && !is_end; offset += kAtOnce) {
    if (!hal.read_flash(hal.context, FlashArea::kBoots, offset, bytes.data(), kAtOnce)) return 0;
    for (uint32_t k = 0; k < kAtOnce && !is_end; ++k) {
      is_end = bytes[k] == kUnused;
      if (is_end) continue;
      row = bytes[k] == kSettled ? 0 : row + 1;
      ++used;
    }
  }
  if (used == kSectorBytes) {
    // Once in four thousand starts; a cut meanwhile forgets the row.
    if (!hal.erase_sector(hal.context, FlashArea::kBoots, 0)) return row;
    used = 0;
  }
  if (hal.program_flash(hal.context, FlashArea::kBoots, used, &kBegun, 1)) at_ = used;
  return row;
}

void BootLog::settle(const Hal& hal) {
  if (is_open()) hal.program_flash(hal.context, FlashArea::kBoots, at_, &kSettled, 1);
  at_ = kSectorBytes;
}

}  // namespace chladni
