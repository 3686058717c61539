#include "core/crc32.hpp"

#include <array>

namespace chladni {

namespace {

constexpr std::array<uint32_t, 16> make_nibbles() {
  std::array<uint32_t, 16> table{};
  for (uint32_t nibble = 0; nibble < 16; ++nibble) {
    uint32_t value = nibble;
    for (int bit = 0; bit < 4; ++bit) value = (value >> 1) ^ ((value & 1U) != 0 ? 0xEDB88320U : 0U);
    table[nibble] = value;
  }
  return table;
}

constexpr std::array<uint32_t, 16> kNibbles = make_nibbles();

}  // namespace

uint32_t crc32_feed(uint32_t running, const uint8_t* bytes, uint32_t count) {
  for (uint32_t k = 0; k < count; ++k) {
    running ^= bytes[k];
    running = kNibbles[running & 15U] ^ (running >> 4);
    running = kNibbles[running & 15U] ^ (running >> 4);
  }
  return running;
}

}  // namespace chladni
