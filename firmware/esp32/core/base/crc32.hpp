// CRC-32 as zlib has it (polynomial 0xEDB88320), four bits at a time.
#pragma once

#include <cstdint>

namespace chladni {

constexpr uint32_t kCrc32Start = 0xFFFFFFFFU;

// Feed bytes into a running value; the CRC is the complement of the last one.
uint32_t crc32_feed(uint32_t running, const uint8_t* bytes, uint32_t count);

// The CRC of bytes that are all there.
inline uint32_t crc32(const uint8_t* bytes, uint32_t count) {
  return crc32_feed(kCrc32Start, bytes, count) ^ 0xFFFFFFFFU;
}

}  // namespace chladni
