// Gains as a table's records store them: two integers of 8, 12 or 16 bits each.
#pragma once

#include <cstdint>

#include "core/base/bytes.hpp"

namespace chladni {

// A gain's two integers as they are stored: the upper bits of a wider one, in offset binary, so
// that no sign has to be extended.
template <uint32_t kBits>
constexpr uint32_t kGainBytes = kBits / 4;
template <uint32_t kBits>
constexpr uint32_t kZero = 1U << (kBits - 1);

struct Codes {
  uint32_t in_phase;
  uint32_t quadrature;
};

template <uint32_t kBits>
inline Codes codes_of(const uint8_t* p) {
  if constexpr (kBits == 8) return {p[0], p[1]};
  if constexpr (kBits == 16) return {read_u16(p), read_u16(p + 2)};
  const uint32_t lower = p[2];
  return {static_cast<uint32_t>(p[0]) << 4 | (lower & 15U),
          static_cast<uint32_t>(p[1]) << 4 | lower >> 4};
}

}  // namespace chladni
