// What the coils' supply delivers, as a mean over any 64 ms: what it and its capacitors bear.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/synthesis/drive.hpp"

namespace chladni {

class SupplyMeter {
 public:
  void start(const Config& config) {
    *this = SupplyMeter{};
    channels_ = config.channels;
    full_current_ma_ = config.full_current_ma;
    limit_ma_ = config.supply_ma;
  }

  // What the pins got in the last milliseconds.
  void add(const Squares& squares, uint32_t milliseconds) {
    if (milliseconds == 0) return;
    uint32_t sum_q8 = 0;
    for (uint32_t k = 0; k < channels_; ++k) {
      sum_q8 += (squares[k] / milliseconds) * full_current_ma_[k] >> 8;
    }
    const uint32_t mean_ma = (sum_q8 + 255U) >> 8;
    const uint32_t shown = milliseconds < kSupplyWindowMs ? milliseconds : kSupplyWindowMs;
    const uint32_t before = late_[at_];
    for (uint32_t passed = 0; passed < shown; ++passed) {
      const uint32_t sum = sums_[at_] + mean_ma;
      at_ = (at_ + 1U) % kSums;
      sums_[at_] = sum;
      late_[at_] = before;
    }
    late_[at_] = before + mean_ma * milliseconds;
    if (charge(sums_, kSupplyWindowMs) == 0) has_streamed_ = false;
  }

  uint32_t mean_ma() const { return charge(sums_, kSupplyWindowMs) / kSupplyWindowMs; }
  // What was reckoned leaves room for rounding, and for a touch that follows another.
  bool is_passed() const { return mean_ma() > most_ma(); }
  // A stream may use a window up in a moment, and a wave then finds none of it left.
  void note_stream() { has_streamed_ = true; }
  bool may_start_wave() const { return !has_streamed_; }
  // Whether the window that ends with a stream's last frame would pass the limit, if those held
  // take so much, mA times ms, in so long.
  bool would_pass(uint32_t ahead, uint32_t ahead_ms) const {
    const uint32_t passed_ms = ahead_ms < kSupplyWindowMs ? kSupplyWindowMs - ahead_ms : 0U;
    const uint32_t before = charge(late_, passed_ms);
    return before + ahead > most_ma() * kSupplyWindowMs;
  }

 private:
  static constexpr uint32_t kSums = kSupplyWindowMs + 1U;

  uint32_t most_ma() const { return limit_ma_ + limit_ma_ / 32U; }

  using Sums = std::array<uint32_t, kSums>;

  // mA times milliseconds, over the last so many.
  uint32_t charge(const Sums& sums, uint32_t milliseconds) const {
    return sums[at_] - sums[(at_ + kSums - milliseconds) % kSums];
  }

  uint32_t channels_ = 0;
  std::array<uint16_t, kMaxChannels> full_current_ma_{};
  uint32_t limit_ma_ = 0;
  bool has_streamed_ = false;
  // Since start, after each of the last milliseconds: what came in a turn of the main loop evenly
  // over it, and all of it at its end, since no one knows when it came.
  Sums sums_{};
  Sums late_{};
  uint32_t at_ = 0;
};

}  // namespace chladni
