// A stream of bits in the table partition, the least significant bit of a byte first.
//
// After anything that cannot be, `status` says so and every number reads as 0: a decoder looks once
// at its end, and its loops end by themselves.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/table_format.hpp"
#include "core/hal.hpp"

namespace chladni {

// 0, 1, 2, 3 … as 0, -1, 1, -2 …: half the code, all its bits turned over if it is odd.
inline int32_t from_zigzag(uint32_t code) {
  return static_cast<int32_t>(code >> 1) ^ -static_cast<int32_t>(code & 1U);
}

class StreamReader {
 public:
  enum class Status : uint8_t { kOk, kReadFailed, kDamaged };

  StreamReader(const Hal& hal, uint32_t offset, uint32_t bytes)
      : hal_(hal), at_(offset), left_bytes_(bytes) {}

  // The next `width` bits, at most 16 of them.
  uint32_t number(uint32_t width) {
    if (count_ < width) refill();
    if (count_ < width) {
      fail(Status::kDamaged);
      return 0;
    }
    const uint32_t value = bits_ & ((1U << width) - 1U);
    bits_ >>= width;
    count_ -= width;
    return value;
  }

  // Ones before a zero.
  uint32_t unary() {
    uint32_t ones = 0;
    for (;;) {
      // In locals, so that a bit costs no memory.
      uint32_t bits = bits_, left = count_;
      while (left > 0 && (bits & 1U) != 0) {
        bits >>= 1;
        --left;
        ++ones;
      }
      if (ones > table_format::kMaxOnes) break;
      if (left > 0) {
        bits_ = bits >> 1;
        count_ = left - 1;
        return ones;
      }
      bits_ = 0;
      count_ = 0;
      refill();
      if (count_ == 0) break;
    }
    fail(Status::kDamaged);
    return 0;
  }

  // Whether the next `width` bits, at most 8, are here and all 0; only then they are taken.
  bool skip_zeros(uint32_t width) {
    if (count_ < width || (bits_ & ((1U << width) - 1U)) != 0) return false;
    bits_ >>= width;
    count_ -= width;
    return true;
  }

  // Bits below the ones of a code, at most 16: of every first number and of every second.
  using RiceWidths = std::array<uint32_t, 2>;

  // Signed numbers in Rice codes, times 2^shift, in pairs. Returns what bits their codes had.
  uint32_t signed_rice(uint32_t pairs, RiceWidths widths, uint32_t shift, int32_t* numbers);

  void fail(Status status) {
    if (status_ == Status::kOk) status_ = status;
    bits_ = 0;
    count_ = 0;
    left_bytes_ = 0;
    held_ = 0;
  }

  Status status() const { return status_; }
  // Nothing is left but the zeros that fill up the last byte.
  bool is_at_end() const { return left_bytes_ == 0 && held_ == 0 && count_ < 8 && bits_ == 0; }

 private:
  static constexpr uint32_t kChunkBytes = 64;
  static constexpr uint32_t kFull = 25;  // bits at least, after a refill
  static constexpr uint32_t kLow = 16;   // more than most codes have

  void refill();
  uint32_t long_code(uint32_t width);

  const Hal& hal_;
  uint32_t at_;
  uint32_t left_bytes_;
  uint32_t bits_ = 0;
  uint32_t count_ = 0;
  std::array<uint8_t, kChunkBytes> chunk_{};
  uint32_t held_ = 0;  // bytes that are still to come, at the chunk's end
  Status status_ = Status::kOk;
};

}  // namespace chladni
