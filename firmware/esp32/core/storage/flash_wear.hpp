// How often flash was erased, and whether it may be written once more: a sector stands 100,000
// erases, and a host may ask for one after another without end.
#pragma once

#include <cstdint>

namespace chladni {

class FlashWear {
 public:
  // What is known from before this start.
  void start(uint32_t erases, uint32_t credit_ms) {
    erases_ = erases;
    credit_ms_ = credit_ms < kMostMs ? credit_ms : kMostMs;
  }
  void pass(uint32_t milliseconds) {
    const uint32_t room = kMostMs - credit_ms_;
    credit_ms_ += milliseconds < room ? milliseconds : room;
  }
  bool may_write() const { return credit_ms_ >= kPerWriteMs; }
  void spend() { credit_ms_ -= may_write() ? kPerWriteMs : credit_ms_; }
  void count(uint32_t erases) { erases_ += erases; }

  // Sectors, since power came on.
  uint32_t erases() const { return erases_; }
  uint32_t credit_ms() const { return credit_ms_; }

 private:
  // So many writes in a row, and one more for each minute that passes.
  static constexpr uint32_t kPerWriteMs = 60000, kAtOnce = 60;
  static constexpr uint32_t kMostMs = kPerWriteMs * kAtOnce;

  uint32_t erases_ = 0;
  uint32_t credit_ms_ = kMostMs;
};

}  // namespace chladni
