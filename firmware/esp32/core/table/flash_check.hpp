// A table's or a bank's CRC once more, a little at a time: bits in flash flip, if rarely.
#pragma once

#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"
#include "core/base/flash_crc.hpp"

namespace chladni {

class FlashCheck {
 public:
  bool is_under_way() const { return total_bytes_ > 0; }
  bool is_due(uint32_t now_ms, uint32_t every_ms) const {
    return !is_under_way() && now_ms - begun_ms_ >= every_ms;
  }
  // Of so many bytes, of which the last four are the CRC of those before; none is nothing to check.
  void begin(uint32_t now_ms, uint32_t total_bytes) {
    begun_ms_ = now_ms;
    total_bytes_ = total_bytes;
    done_ = 0;
    running_ = kCrc32Start;
  }
  // The next few bytes; kRight until the last of them say otherwise.
  FlashCrc advance(const uint8_t* bytes) {
    const uint32_t covered = total_bytes_ - 4U, left = covered - done_;
    const uint32_t count = left < kAtOnce ? left : kAtOnce;
    running_ = crc32_feed(running_, bytes + done_, count);
    done_ += count;
    if (done_ < covered) return FlashCrc::kRight;
    total_bytes_ = 0;
    return read_u32(bytes + covered) == (running_ ^ 0xFFFFFFFFU) ? FlashCrc::kRight
                                                                 : FlashCrc::kWrong;
  }

 private:
  static constexpr uint32_t kAtOnce = 512;  // a tenth of a millisecond

  uint32_t begun_ms_ = 0;
  uint32_t total_bytes_ = 0;
  uint32_t done_ = 0;
  uint32_t running_ = 0;
};

}  // namespace chladni
