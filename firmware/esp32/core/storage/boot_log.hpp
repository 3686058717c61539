// Starts that did not last, counted in a sector of flash: a byte each, begun and then settled. A
// supply that gives way under the coils takes the whole chip down and up again, and RAM forgets; a
// crash at start brings the next start, and that the next crash.
#pragma once

#include <cstdint>

#include "core/hal.hpp"

namespace chladni {

class BootLog {
 public:
  // Enter this start; how many right before it did not settle. 0 where there is no such sector.
  uint32_t begin(const Hal& hal);
  // This one has lasted.
  void settle(const Hal& hal);
  bool is_open() const { return at_ < kSectorBytes; }

 private:
  uint32_t at_ = kSectorBytes;  // of this start
};

}  // namespace chladni
