#include "core/base/text.hpp"

namespace chladni {

namespace {

bool is_break(char c) { return c == '\0' || c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

}  // namespace

void Reader::skip_spaces() {
  while (*at_ != '\0' && is_break(*at_)) ++at_;
}

bool Reader::at_end() {
  skip_spaces();
  return *at_ == '\0';
}

bool Reader::word(const char* expected) {
  skip_spaces();
  const char* here = at_;
  while (*expected != '\0' && *here == *expected) {
    ++here;
    ++expected;
  }
  if (*expected != '\0' || !is_break(*here)) return false;
  at_ = here;
  return true;
}

bool Reader::number(int32_t* value) {
  skip_spaces();
  const char* here = at_;
  const bool is_negative = *here == '-';
  if (is_negative) ++here;
  int32_t result = 0;
  int digits = 0;
  while (*here >= '0' && *here <= '9' && digits < 10) {
    result = digits < 9 ? result * 10 + (*here - '0') : 0;
    ++digits;
    ++here;
  }
  if (digits < 1 || digits > 9 || !is_break(*here)) return false;
  *value = is_negative ? -result : result;
  at_ = here;
  return true;
}

void Line80::put(char c) {
  if (length_ + 1U < text_.size()) text_[length_++] = c;
}

Line80& Line80::add(const char* text) {
  for (; *text != '\0'; ++text) put(*text);
  return *this;
}

Line80& Line80::add(uint32_t number) {
  std::array<char, 10> digits{};
  uint32_t count = 0;
  do {
    digits[count++] = static_cast<char>('0' + number % 10U);
    number /= 10U;
  } while (number > 0);
  while (count > 0) put(digits[--count]);
  return *this;
}

Line80& Line80::add_milli(uint32_t number) {
  add(number / 1000U).add(".");
  const uint32_t rest = number % 1000U;
  if (rest < 100U) put('0');
  if (rest < 10U) put('0');
  return add(rest);
}

}  // namespace chladni
