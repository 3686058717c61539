#include "core/storage/retained.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

constexpr uint32_t kMagic = 0x52484C43;  // "CLHR"; all zeros have a CRC that is right
constexpr uint32_t kWords = 4U + table_format::kMaxActuators;
static_assert(kRetainedBytes == 4U * (kWords + 1U), "a word each, and the CRC");

}  // namespace

bool recall(const Hal& hal, Retained& found) {
  const uint8_t* const bytes = hal.retained(hal.context);
  if (read_u32(bytes) != kMagic || crc32(bytes, 4U * kWords) != read_u32(bytes + 4U * kWords)) {
    return false;
  }
  const uint8_t* at = bytes + 4;
  for (uint32_t& rise : found.rise_uk) {
    rise = read_u32(at);
    at += 4;
  }
  found.is_on = read_u32(at);
  found.erases = read_u32(at + 4);
  found.write_credit_ms = read_u32(at + 8);
  return true;
}

void keep(const Hal& hal, const Retained& state) {
  uint8_t* const bytes = hal.retained(hal.context);
  put_word(bytes, kMagic, 4);
  uint8_t* at = bytes + 4;
  for (const uint32_t rise : state.rise_uk) {
    put_word(at, rise, 4);
    at += 4;
  }
  put_word(at, state.is_on, 4);
  put_word(at + 4, state.erases, 4);
  put_word(at + 8, state.write_credit_ms, 4);
  put_word(bytes + 4U * kWords, crc32(bytes, 4U * kWords), 4);
}

}  // namespace chladni
