// What programs without a C library need: what compilers call for copies and blanks, and a way to
// say a number.
#pragma once

#include <stddef.h>

#include <cstdint>

extern "C" {
void write_host(const char* bytes, uint32_t count);
uint32_t counter();

#ifndef ON_THIS_MACHINE
inline __attribute__((used)) void* memcpy(void* to, const void* from, size_t count) {
  auto* t = static_cast<uint8_t*>(to);
  const auto* f = static_cast<const uint8_t*>(from);
  for (; count > 0; --count) *t++ = *f++;
  return to;
}
inline __attribute__((used)) void* memset(void* to, int value, size_t count) {
  auto* t = static_cast<uint8_t*>(to);
  for (; count > 0; --count) *t++ = static_cast<uint8_t>(value);
  return to;
}
#endif
}

// "name value\n", the name in one or two parts, the value as eight hexadecimal digits.
inline void say(const char* name, uint32_t value, const char* begins = "") {
  char line[64];
  uint32_t at = 0;
  const char* const parts[] = {begins, name};
  for (const char* part : parts) {
    for (; *part != 0 && at < 48; ++part) line[at++] = *part;
  }
  line[at++] = ' ';
  for (int shift = 28; shift >= 0; shift -= 4)
    line[at++] = "0123456789abcdef"[(value >> shift) & 15];
  line[at++] = '\n';
  line[at] = 0;
  write_host(line, at);
}
