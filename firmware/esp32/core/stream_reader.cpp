#include "core/stream_reader.hpp"

namespace chladni {

void StreamReader::refill() {
  while (count_ < kFull) {
    if (held_ == 0) {
      if (left_bytes_ == 0) return;
      held_ = left_bytes_ < kChunkBytes ? left_bytes_ : kChunkBytes;
      if (!hal_.read_flash(hal_.context, FlashArea::kTables, at_, &chunk_[kChunkBytes - held_],
                           held_)) {
        fail(Status::kReadFailed);
        return;
      }
      at_ += held_;
      left_bytes_ -= held_;
    }
    // In locals, so that a byte costs little memory.
    const uint8_t* byte = &chunk_[kChunkBytes - held_];
    uint32_t bits = bits_, count = count_, held = held_;
    do {
      bits |= static_cast<uint32_t>(*byte++) << count;
      count += 8;
      --held;
    } while (count < kFull && held != 0);
    bits_ = bits;
    count_ = count;
    held_ = held;
  }
}

// A code that is longer than what is here, which is rare.
uint32_t StreamReader::long_code(uint32_t width) {
  const uint32_t code = unary() << width;
  return code + number(width);
}

uint32_t StreamReader::signed_rice(uint32_t pairs, RiceWidths widths, uint32_t shift,
                                   int32_t* numbers) {
  // In locals, so that a bit costs no memory.
  uint32_t bits = bits_, left = count_, all = 0;
  // Of a width: the largest number below the ones. Both take turns.
  uint32_t width = widths[0], below = (1U << width) - 1U;
  const uint32_t turn_width = width ^ widths[1], turn_below = below ^ ((1U << widths[1]) - 1U);
  for (int32_t* const end = numbers + 2 * pairs; numbers != end; ++numbers) {
    if (left < kLow) {
      bits_ = bits;
      count_ = left;
      refill();
      bits = bits_;
      left = count_;
    }
    if ((bits & (2 * below + 1)) == 0 && left > width) {  // a zero, as most are
      bits = (bits >> 1) >> width;
      left -= width + 1;
      *numbers = 0;
    } else {
      uint32_t code = 0, rest = bits, after = left - 1 - width;
      while ((rest & 1U) != 0) {
        rest >>= 1;
        code += below + 1;
        --after;
      }
      // Below 0, and so a large number, if the code is longer than what is here.
      if (after <= left) {
        rest >>= 1;
        code += rest & below;
        bits = rest >> width;
        left = after;
      } else {
        bits_ = bits;
        count_ = left;
        code = long_code(width);
        bits = bits_;
        left = count_;
      }
      all |= code;
      *numbers = static_cast<int32_t>(static_cast<uint32_t>(from_zigzag(code)) << shift);
    }
    width ^= turn_width;
    below ^= turn_below;
  }
  bits_ = bits;
  count_ = left;
  return all;
}

}  // namespace chladni
