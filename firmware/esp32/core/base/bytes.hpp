// Little-endian numbers in bytes, as flash and the link have them.
#pragma once

#include <array>
#include <cstddef>
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

// Printable ASCII, filled up with zeros, at least one of them.
inline bool is_name(const uint8_t* name, uint32_t size) {
  uint32_t length = size;
  while (length > 0 && name[length - 1U] == 0) --length;
  for (uint32_t k = 0; k < length; ++k) {
    if (name[k] < 0x20 || name[k] > 0x7E) return false;
  }
  return length < size;
}

// What generated headers read and write their fields with.
struct Take {
  template <typename T>
  void operator()(const uint8_t* from, T& value) const {
    value = static_cast<T>(word(from, sizeof(T)));
  }
  void operator()(const uint8_t* from, uint64_t& value) const {
    value = static_cast<uint64_t>(word(from + 4, 4)) << 32 | word(from, 4);
  }
  template <typename T, size_t kCount>
  void operator()(const uint8_t* from, std::array<T, kCount>& values) const {
    for (size_t k = 0; k < kCount; ++k) (*this)(from + k * sizeof(T), values[k]);
  }
};

struct Put {
  template <typename T>
  void operator()(uint8_t* to, const T& value) const {
    put_word(to, static_cast<uint32_t>(value), sizeof(T));
  }
  void operator()(uint8_t* to, const uint64_t& value) const {
    put_word(to, static_cast<uint32_t>(value), 4);
    put_word(to + 4, static_cast<uint32_t>(value >> 32), 4);
  }
  template <typename T, size_t kCount>
  void operator()(uint8_t* to, const std::array<T, kCount>& values) const {
    for (size_t k = 0; k < kCount; ++k) (*this)(to + k * sizeof(T), values[k]);
  }
};

}  // namespace chladni
