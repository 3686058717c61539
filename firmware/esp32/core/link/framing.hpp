// Frames and lines out of a stream of bytes, and frames into one.
//
// A frame stands between two zeros, COBS-coded, so that no zero is in it (Cheshire and Baker, IEEE/
// ACM ToN 7(2), 1999), and ends in its CRC-32. What is not between zeros is text.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/link_format.hpp"

namespace chladni {

class FrameReader {
 public:
  enum class Found : uint8_t { kNothing, kFrame, kLine };

  // The next byte. After kFrame, `bytes` and `size` give kind, sequence and payload, the CRC taken
  // off; after kLine, `line` the text; both until the next byte.
  Found take(uint8_t byte, uint32_t now_ms);

  const uint8_t* bytes() const { return buffer_.data(); }
  uint32_t size() const { return size_; }
  const char* line() const { return line_.data(); }
  // Frames that were damaged, since start.
  uint32_t damaged() const { return damaged_; }

 private:
  static constexpr uint32_t kMostCoded =
      link_format::kMaxFrame + link_format::kMaxFrame / 254U + 2U;

  Found end_frame();
  Found take_text(uint8_t byte);
  bool decode();

  std::array<uint8_t, kMostCoded> buffer_{};
  uint32_t size_ = 0;
  bool is_in_frame_ = false;
  bool is_too_long_ = false;
  uint32_t last_ms_ = 0;
  uint32_t damaged_ = 0;
  std::array<char, 80> line_{};
  uint32_t line_length_ = 0;
  bool is_line_overlong_ = false;
};

// Codes `count` bytes and their CRC between two zeros; returns how many bytes that makes. `out` has
// room for count + 4 + (count + 4) / 254 + 3.
uint32_t encode_frame(const uint8_t* bytes, uint32_t count, uint8_t* out);

}  // namespace chladni
