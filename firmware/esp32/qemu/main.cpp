// The core on another processor: decodes a table, looks places up, and says how many instructions
// that took and what came out, for tools/instruction_counts.py.
#include <cstdint>

#include "core/crc32.hpp"
#include "core/table.hpp"

extern "C" {
void write_host(const char* bytes, uint32_t count);
uint32_t counter();
extern const uint8_t table_begin[];
extern const uint8_t table_end[];

// What compilers call for copies and blanks.
void* memcpy(void* to, const void* from, size_t count) {
  auto* t = static_cast<uint8_t*>(to);
  const auto* f = static_cast<const uint8_t*>(from);
  for (; count > 0; --count) *t++ = *f++;
  return to;
}
void* memset(void* to, int value, size_t count) {
  auto* t = static_cast<uint8_t*>(to);
  for (; count > 0; --count) *t++ = static_cast<uint8_t>(value);
  return to;
}
#ifdef __XTENSA__
// The lx106 has no division; the ESP32's LX6 divides in hardware, and only while a table is loaded.
uint32_t __udivsi3(uint32_t dividend, uint32_t divisor) {
  uint32_t quotient = 0, rest = 0;
  for (int bit = 31; bit >= 0; --bit) {
    rest = (rest << 1) | ((dividend >> bit) & 1U);
    if (rest >= divisor) {
      rest -= divisor;
      quotient |= 1U << bit;
    }
  }
  return quotient;
}
uint32_t __umodsi3(uint32_t dividend, uint32_t divisor) {
  return dividend - __udivsi3(dividend, divisor) * divisor;
}
#endif
}

namespace {

constexpr uint32_t kPlaces = 4000;

bool read_table(void*, uint32_t offset, uint8_t* bytes, uint32_t count) {
  const auto size = static_cast<uint32_t>(table_end - table_begin);
  if (offset > size || count > size - offset) return false;
  for (uint32_t k = 0; k < count; ++k) bytes[k] = table_begin[offset + k];
  return true;
}

// "name value\n"
void say(const char* name, uint32_t value) {
  char line[64];
  uint32_t at = 0;
  while (name[at] != 0 && at < 48) {
    line[at] = name[at];
    ++at;
  }
  line[at++] = ' ';
  for (int shift = 28; shift >= 0; shift -= 4)
    line[at++] = "0123456789abcdef"[(value >> shift) & 15];
  line[at++] = '\n';
  line[at] = 0;
  write_host(line, at);
}

chladni::Table table;

}  // namespace

int main() {
  chladni::Hal hal{};
  hal.read_table = read_table;
  const uint32_t nothing = counter();
  const uint32_t overhead = counter() - nothing;
  uint32_t begin = counter();
  const chladni::TableStatus status = table.load(hal, CHANNELS);
  say("load", counter() - begin - overhead);
  say("status", static_cast<uint32_t>(status));
  // The same places as tools/instruction_counts.py: a linear congruential sequence.
  uint32_t seed = 1, most = 0, sum = 0, crc = chladni::kCrc32Start;
  chladni::Drive drive{};
  for (uint32_t k = 0; k < kPlaces; ++k) {
    seed = seed * 1664525U + 1013904223U;
    const auto x_um = static_cast<int32_t>(seed >> 16) - 32768;
    seed = seed * 1664525U + 1013904223U;
    const auto y_um = static_cast<int32_t>(seed >> 15) - 65536;
    begin = counter();
    table.drive_at({x_um, y_um}, drive);
    const uint32_t taken = counter() - begin - overhead;
    sum += taken;
    if (taken > most) most = taken;
    for (uint32_t channel = 0; channel < CHANNELS; ++channel) {
      const auto i = static_cast<uint16_t>(drive[channel].in_phase_q15);
      const auto q = static_cast<uint16_t>(drive[channel].quadrature_q15);
      const uint8_t bytes[4] = {static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8),
                                static_cast<uint8_t>(q), static_cast<uint8_t>(q >> 8)};
      crc = chladni::crc32_feed(crc, bytes, 4);
    }
  }
  say("lookup_most", most);
  say("lookup_sum", sum);
  say("lookups", kPlaces);
  say("drives_crc", crc ^ 0xFFFFFFFFU);
  return 0;
}
