#include "core/base/crc32.hpp"

#include <array>

namespace chladni {

namespace {

constexpr std::array<uint32_t, 256> make_bytes() {
  std::array<uint32_t, 256> table{};
  for (uint32_t byte = 0; byte < table.size(); ++byte) {
    uint32_t value = byte;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1U) != 0 ? 0xEDB88320U : 0U);
    table[byte] = value;
  }
  return table;
}

constexpr std::array<uint32_t, 256> kBytes = make_bytes();

}  // namespace

uint32_t crc32_feed(uint32_t running, const uint8_t* bytes, uint32_t count) {
  for (const uint8_t* const end = bytes + count; bytes != end; ++bytes) {
    running = kBytes[(running ^ *bytes) & 0xFFU] ^ (running >> 8);
  }
  return running;
}

}  // namespace chladni
