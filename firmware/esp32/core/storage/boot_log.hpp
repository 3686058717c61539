// Starts that did not last, and updates of flash, in a sector of flash: a byte each. A supply that
// gives way under the coils takes the whole chip down and up again, and RAM forgets; a crash at
// start brings the next start, and that the next crash. What an update wears must not be forgotten
// either, or whoever takes the power away has all updates again.
//
// The sector is erased when it is full, so once in four thousand starts and updates: at three
// starts a second for four years before it has stood 100,000 erases.
#pragma once

#include <cstdint>

#include "core/hal.hpp"

namespace chladni {

class BootLog {
 public:
  // Updates that a loss of power gives back, and no more.
  static constexpr uint32_t kMostOwed = 5;

  // Enter this start; how many right before it did not settle. 0 where there is no such sector.
  uint32_t begin(const Hal& hal);
  // This one has lasted.
  void settle(const Hal& hal);
  bool is_open() const { return at_ < kSectorBytes; }

  // An update is about to erase; and a minute has passed that makes up for one.
  void enter_update(const Hal& hal);
  void enter_minute(const Hal& hal);
  // Ever, as far as this sector tells; and those that no minute has made up for, kMostOwed at most.
  uint32_t updates() const { return updates_; }
  uint32_t owed() const { return owed_; }

 private:
  void count(uint8_t mark, uint32_t& row);
  void enter(const Hal& hal, uint8_t mark);
  bool begin_again(const Hal& hal);

  uint32_t at_ = kSectorBytes;  // of this start
  uint32_t used_ = 0;           // bytes
  bool is_there_ = false;       // the sector
  uint32_t updates_ = 0;
  uint32_t owed_ = 0;
};

}  // namespace chladni
