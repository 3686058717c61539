// What compilers call for copies, blanks and divisions, for programs without a C library.
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
