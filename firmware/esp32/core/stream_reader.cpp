#include "core/stream_reader.hpp"

namespace chladni {

void StreamReader::refill() {
  while (count_ < kFull) {
    if (held_ == 0) {
      if (left_bytes_ == 0) return;
      held_ = left_bytes_ < kChunkBytes ? left_bytes_ : kChunkBytes;
      if (!hal_.read_flash(hal_.context, FlashArea::kTables, at_, chunk_.data(), held_)) {
        fail(Status::kReadFailed);
        return;
      }
      at_ += held_;
      left_bytes_ -= held_;
      next_ = 0;
    }
    bits_ |= static_cast<uint32_t>(chunk_[next_++]) << count_;
    count_ += 8;
    --held_;
  }
}

void StreamReader::rice(uint32_t pairs, uint32_t width_one, uint32_t width_other, uint32_t* codes) {
  // In locals, so that a bit costs no memory.
  uint32_t bits = bits_, left = count_, width = width_one;
  for (uint32_t* const end = codes + 2 * pairs; codes != end; ++codes) {
    if (left < kLow) {
      bits_ = bits;
      count_ = left;
      refill();
      bits = bits_;
      left = count_;
    }
    uint32_t ones = 0, rest = bits;
    while ((rest & 1U) != 0) {
      rest >>= 1;
      ++ones;
    }
    const uint32_t taken = ones + 1 + width;
    if (taken <= left) {
      rest >>= 1;
      // NOLINTNEXTLINE(clang-analyzer-core.BitwiseShift): one of the two widths, in turn
      *codes = (ones << width) + (rest & ((1U << width) - 1U));
      bits = rest >> width;
      left -= taken;
    } else {
      // Longer than what is here, which is rare: by way of the other two.
      bits_ = bits;
      count_ = left;
      ones = unary();
      *codes = (ones << width) + number(width);
      bits = bits_;
      left = count_;
    }
    width = width_one + width_other - width;
  }
  bits_ = bits;
  count_ = left;
}

}  // namespace chladni
