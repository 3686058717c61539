#include "core/base/flash_crc.hpp"

#include <array>

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

constexpr uint32_t kChunkBytes = 64;
constexpr uint32_t kCrcBytes = 4;

}  // namespace

FlashCrc check_flash_crc(const Hal& hal, FlashArea area, uint32_t offset, uint32_t total,
                         uint32_t& crc) {
  std::array<uint8_t, kChunkBytes> chunk{};
  uint32_t running = kCrc32Start;
  const uint32_t covered = total - kCrcBytes;
  for (uint32_t done = 0; done < covered;) {
    const uint32_t count = covered - done < kChunkBytes ? covered - done : kChunkBytes;
    if (!hal.read_flash(hal.context, area, offset + done, chunk.data(), count)) {
      return FlashCrc::kReadFailed;
    }
    running = crc32_feed(running, chunk.data(), count);
    done += count;
  }
  if (!hal.read_flash(hal.context, area, offset + covered, chunk.data(), kCrcBytes)) {
    return FlashCrc::kReadFailed;
  }
  crc = running ^ 0xFFFFFFFFU;
  return read_u32(chunk.data()) == crc ? FlashCrc::kRight : FlashCrc::kWrong;
}

}  // namespace chladni
