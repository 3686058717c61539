#include "core/storage/retained.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

constexpr uint32_t kMagic = 0x52484C43;  // "CLHR"; all zeros have a CRC that is right
constexpr uint32_t kWords = 5U + gpio::kPins;
constexpr uint32_t kCrashMagic = 0x52434C43;  // "CLCR"
constexpr uint32_t kCrashesAt = 4U * (kWords + 1U);
static_assert(kRetainedBytes == kCrashesAt + 12U,
              "a word each and the CRC; crashes in three words");
// More are not told apart.
constexpr uint32_t kMostCrashes = 1000;

void keep_crashes(const Hal& hal, uint32_t count) {
  uint8_t* const bytes = hal.retained(hal.context) + kCrashesAt;
  put_word(bytes, kCrashMagic, 4);
  put_word(bytes + 4, count, 4);
  put_word(bytes + 8, crc32(bytes, 8), 4);
}

}  // namespace

Retained recall(const Hal& hal) {
  Retained found;
  const uint8_t* const bytes = hal.retained(hal.context);
  if (read_u32(bytes) != kMagic || crc32(bytes, 4U * kWords) != read_u32(bytes + 4U * kWords)) {
    found.heat.rise_uk.fill(PinHeat::kUnknown);
    return found;
  }
  const uint8_t* at = bytes + 4;
  for (uint32_t& rise : found.heat.rise_uk) {
    rise = read_u32(at);
    at += 4;
  }
  found.heat.assumed_dk = read_u32(at);
  found.is_on = read_u32(at + 4);
  found.erases = read_u32(at + 8);
  found.write_credit_ms = read_u32(at + 12);
  return found;
}

void keep(const Hal& hal, const Retained& state) {
  uint8_t* const bytes = hal.retained(hal.context);
  put_word(bytes, kMagic, 4);
  uint8_t* at = bytes + 4;
  for (const uint32_t rise : state.heat.rise_uk) {
    put_word(at, rise, 4);
    at += 4;
  }
  put_word(at, state.heat.assumed_dk, 4);
  put_word(at + 4, state.is_on, 4);
  put_word(at + 8, state.erases, 4);
  put_word(at + 12, state.write_credit_ms, 4);
  put_word(bytes + 4U * kWords, crc32(bytes, 4U * kWords), 4);
}

uint32_t count_crash(const Hal& hal, bool has_crashed) {
  const uint8_t* const bytes = hal.retained(hal.context) + kCrashesAt;
  const bool is_known = read_u32(bytes) == kCrashMagic && crc32(bytes, 8) == read_u32(bytes + 8);
  uint32_t count = is_known ? read_u32(bytes + 4) : 0U;
  if (has_crashed && count < kMostCrashes) ++count;
  keep_crashes(hal, count);
  return count;
}

void forget_crashes(const Hal& hal) { keep_crashes(hal, 0); }

}  // namespace chladni
