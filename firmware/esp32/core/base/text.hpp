// Lines of text: words and whole numbers read from one, and put into one.
#pragma once

#include <array>
#include <cstdint>

namespace chladni {

class Reader {
 public:
  explicit Reader(const char* line) : at_(line) {}

  // Whether the next word is `expected`; moves past it if so.
  bool word(const char* expected);
  // A whole number of up to nine digits, with an optional minus sign.
  bool number(int32_t* value);
  bool at_end();

 private:
  void skip_spaces();

  const char* at_;
};

// What does not fit is left out.
class Line80 {
 public:
  Line80& add(const char* text);
  Line80& add(uint32_t number);
  // A number in thousandths, with three decimals.
  Line80& add_milli(uint32_t number);
  const char* text() const { return text_.data(); }

 private:
  void put(char c);

  std::array<char, 81> text_{};
  uint32_t length_ = 0;
};

}  // namespace chladni
