// Little-endian numbers in bytes, as flash and the link have them.
#pragma once

#include <cstdint>

namespace chladni {

// The first `count` bytes, at most four.
inline uint32_t word(const uint8_t* bytes, uint32_t count) {
  uint32_t value = 0;
  for (uint32_t k = count; k > 0; --k) value = (value << 8) | bytes[k - 1U];
  return value;
}

inline uint32_t read_u16(const uint8_t* bytes) { return word(bytes, 2); }
inline uint32_t read_u32(const uint8_t* bytes) { return word(bytes, 4); }

inline void put_word(uint8_t* bytes, uint32_t value, uint32_t count) {
  for (uint32_t k = 0; k < count; ++k) bytes[k] = static_cast<uint8_t>((value >> (8U * k)) & 0xFFU);
}

}  // namespace chladni
