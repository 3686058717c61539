// How often flash may be written: a sector stands 100,000 erases, and a host may ask for one after
// another without end.
#pragma once

#include <cstdint>

namespace chladni {

// So many writes in a row, and one more for each minute that passes.
class WriteBudget {
 public:
  static constexpr uint32_t kPerWriteMs = 60000, kAtOnce = 60;
  static constexpr uint32_t kMostMs = kPerWriteMs * kAtOnce;

  void start(uint32_t credit_ms) { credit_ms_ = credit_ms < kMostMs ? credit_ms : kMostMs; }
  void pass(uint32_t milliseconds) {
    const uint32_t room = kMostMs - credit_ms_;
    credit_ms_ += milliseconds < room ? milliseconds : room;
  }
  bool is_left() const { return credit_ms_ >= kPerWriteMs; }
  void spend() { credit_ms_ -= is_left() ? kPerWriteMs : credit_ms_; }
  uint32_t credit_ms() const { return credit_ms_; }

 private:
  uint32_t credit_ms_ = kMostMs;
};

}  // namespace chladni
