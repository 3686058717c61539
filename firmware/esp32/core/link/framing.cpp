#include "core/link/framing.hpp"

#include "core/base/crc32.hpp"

namespace chladni {

namespace f = link_format;

FrameReader::Found FrameReader::take(uint8_t byte, uint32_t now_ms) {
  if (is_in_frame_ && now_ms - last_ms_ >= f::kSilenceMs) {
    is_in_frame_ = false;
    line_length_ = 0;
  }
  last_ms_ = now_ms;
  if (byte == 0) return end_frame();
  if (!is_in_frame_) return take_text(byte);
  if (size_ < buffer_.size()) {
    buffer_[size_++] = byte;
  } else {
    is_too_long_ = true;
  }
  return Found::kNothing;
}

// A zero ends a frame, and begins one.
FrameReader::Found FrameReader::end_frame() {
  const bool had_bytes = is_in_frame_ && size_ > 0;
  const bool is_good = had_bytes && !is_too_long_ && decode();
  if (had_bytes && !is_good) ++damaged_;
  // After a good frame text may follow. After anything else this zero may be a frame's first.
  is_in_frame_ = !is_good;
  is_too_long_ = false;
  line_length_ = 0;
  is_line_overlong_ = false;
  if (is_good) return Found::kFrame;
  size_ = 0;
  return Found::kNothing;
}

FrameReader::Found FrameReader::take_text(uint8_t byte) {
  size_ = 0;
  if (byte != '\n' && byte != '\r') {
    if (line_length_ + 1U < line_.size()) {
      line_[line_length_++] = static_cast<char>(byte);
    } else {
      is_line_overlong_ = true;
    }
    return Found::kNothing;
  }
  const bool has_line = line_length_ > 0;
  // A line that did not fit is answered like any other that makes no sense.
  if (is_line_overlong_) line_length_ = 0;
  line_[line_length_] = '\0';
  line_length_ = 0;
  is_line_overlong_ = false;
  return has_line ? Found::kLine : Found::kNothing;
}

// In place: what is written is never ahead of what is read.
bool FrameReader::decode() {
  uint32_t from = 0, to = 0;
  while (from < size_) {
    const uint32_t code = buffer_[from++];
    if (code - 1U > size_ - from) return false;
    for (uint32_t k = 1; k < code; ++k) buffer_[to++] = buffer_[from++];
    if (code < 0xFFU && from < size_) buffer_[to++] = 0;
  }
  if (to < f::kHeadBytes + f::kCrcBytes) return false;
  size_ = to - f::kCrcBytes;
  const uint32_t crc = crc32(buffer_.data(), size_);
  for (uint32_t k = 0; k < f::kCrcBytes; ++k) {
    if (buffer_[size_ + k] != static_cast<uint8_t>(crc >> (8U * k))) return false;
  }
  return true;
}

uint32_t encode_frame(const uint8_t* bytes, uint32_t count, uint8_t* out) {
  const uint32_t crc = crc32(bytes, count);
  uint32_t at = 0, code_at = 1;
  out[at++] = 0;
  ++at;
  uint32_t code = 1;
  const auto put = [&](uint8_t byte) {
    if (byte != 0) {
      out[at++] = byte;
      ++code;
    }
    if (byte == 0 || code == 0xFFU) {
      out[code_at] = static_cast<uint8_t>(code);
      code = 1;
      code_at = at++;
    }
  };
  for (uint32_t k = 0; k < count; ++k) put(bytes[k]);
  for (uint32_t k = 0; k < f::kCrcBytes; ++k) put(static_cast<uint8_t>((crc >> (8U * k)) & 0xFFU));
  out[code_at] = static_cast<uint8_t>(code);
  out[at++] = 0;
  return at;
}

}  // namespace chladni
