// Reads words and whole numbers from one line of text.
#pragma once

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

}  // namespace chladni
