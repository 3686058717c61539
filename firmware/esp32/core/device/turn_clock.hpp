// Time in the main loop's turns, which are about a millisecond long.
#pragma once

#include <cstdint>

namespace chladni {

class TurnClock {
 public:
  void start(uint32_t now_us, uint32_t first_ms) {
    *this = TurnClock{};
    turned_us_ = now_us;
    now_ms_ = awake_ms_ = first_ms;
  }
  // A turn begins; whole milliseconds since the last one.
  uint32_t turn(uint32_t now_us) {
    const uint32_t passed_ms = (now_us - turned_us_) / 1000U;
    turned_us_ += passed_ms * 1000U;
    now_ms_ += passed_ms;
    awake_ms_ += passed_ms < kLongTurnMs ? passed_ms : kLongTurnMs;
    return passed_ms;
  }
  // Since start.
  uint32_t now_ms() const { return now_ms_; }
  // The same, but for turns that took long, as erasing does: what came in them was not late.
  uint32_t awake_ms() const { return awake_ms_; }

 private:
  static constexpr uint32_t kLongTurnMs = 10;

  uint32_t turned_us_ = 0;
  uint32_t now_ms_ = 0;
  uint32_t awake_ms_ = 0;
};

// How long something has lasted, or did the last time.
class Stopwatch {
 public:
  void start(uint32_t now_ms) {
    is_running_ = true;
    begun_ms_ = now_ms;
  }
  void stop(uint32_t now_ms) {
    lasted_ms_ = passed_ms(now_ms);
    is_running_ = false;
  }
  uint32_t passed_ms(uint32_t now_ms) const {
    return is_running_ ? now_ms - begun_ms_ : lasted_ms_;
  }

 private:
  bool is_running_ = false;
  uint32_t begun_ms_ = 0;
  uint32_t lasted_ms_ = 0;
};

}  // namespace chladni
