#include "core/stream_reader.hpp"

namespace chladni {

void StreamReader::refill() {
  while (count_ < kFull) {
    if (held_ == 0) {
      if (left_bytes_ == 0) return;
      held_ = left_bytes_ < kChunkBytes ? left_bytes_ : kChunkBytes;
      if (!hal_.read_table(hal_.context, at_, chunk_.data(), held_)) {
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

}  // namespace chladni
