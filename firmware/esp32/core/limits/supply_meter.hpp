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

  // What the pins got in the last milliseconds, one at least.
  void add(const Squares& squares, uint32_t milliseconds) {
    uint32_t sum_q8 = 0;
    for (uint32_t k = 0; k < channels_; ++k) {
      sum_q8 += (squares[k] / milliseconds) * full_current_ma_[k] >> 8;
    }
    const uint32_t mean_q4 = (sum_q8 + 15U) >> 4;
    const uint32_t shown = milliseconds < kSupplyWindowMs ? milliseconds : kSupplyWindowMs;
    const uint32_t before = late_q4_[at_];
    for (uint32_t passed = 0; passed < shown; ++passed) {
      const uint32_t sum = sums_q4_[at_] + mean_q4;
      at_ = (at_ + 1U) % kSums;
      sums_q4_[at_] = sum;
      late_q4_[at_] = before;
    }
    late_q4_[at_] = before + mean_q4 * (milliseconds < 1000U ? milliseconds : 1000U);
    if (charge_q4(sums_q4_, kSupplyWindowMs) == 0) has_streamed_ = false;
  }

  uint32_t mean_ma() const {
    return charge_q4(sums_q4_, kSupplyWindowMs) / (16U * kSupplyWindowMs);
  }
  // Nothing that was reckoned gets there (`reckoned_limit`). A host that turns phases against the
  // wave does, and so do late samples. Outputs then go off at once: at the crest of a triangle,
  // three times its mean, a turn and half a millisecond more deliver 7 % of a window, so that no
  // window has a twentieth more than the limit. `crest_ma` is the most that a frame of the stream
  // takes, 0 for waves.
  bool is_passed(uint32_t crest_ma) const {
    return charge_q4(sums_q4_, kSupplyWindowMs) + reserve_q4(crest_ma) >
           limit_q4() - limit_q4() / 40U;
  }
  // A stream may use a window up in a moment, and a wave then finds none of it left.
  void note_stream() { has_streamed_ = true; }
  bool may_start_wave() const { return !has_streamed_; }
  // Whether the window that ends with a stream's last frame would pass the limit, if those held
  // take so much, mA times ms, in so long.
  bool would_pass(uint32_t ahead, uint32_t ahead_ms, uint32_t crest_ma) const {
    const uint32_t passed_ms = ahead_ms < kSupplyWindowMs ? kSupplyWindowMs - ahead_ms : 0U;
    return charge_q4(late_q4_, passed_ms) + 16U * ahead + reserve_q4(crest_ma) >
           16U * reckoned_limit(limit_ma_) * kSupplyWindowMs;
  }

 private:
  static constexpr uint32_t kSums = kSupplyWindowMs + 1U;
  using Sums = std::array<uint32_t, kSums>;

  // All in mA times milliseconds and four bits more: what a window may have, and what came in the
  // last milliseconds.
  uint32_t limit_q4() const { return 16U * limit_ma_ * kSupplyWindowMs; }
  // A frame may ask for far more than a wave's crest. What a turn and half a millisecond of it
  // deliver beyond 3/40 of a window, which lie between the end and a twentieth more, is kept free.
  uint32_t reserve_q4(uint32_t crest_ma) const {
    const uint32_t delivered_q4 = 24U * crest_ma, borne_q4 = limit_q4() / 40U * 3U;
    return delivered_q4 > borne_q4 ? delivered_q4 - borne_q4 : 0U;
  }
  uint32_t charge_q4(const Sums& sums, uint32_t milliseconds) const {
    return sums[at_] - sums[(at_ + kSums - milliseconds) % kSums];
  }

  uint32_t channels_ = 0;
  std::array<uint16_t, kMaxChannels> full_current_ma_{};
  uint32_t limit_ma_ = 0;
  bool has_streamed_ = false;
  // Since start, after each of the last milliseconds: what came in a turn of the main loop evenly
  // over it, and all of it at its end, since no one knows when it came.
  Sums sums_q4_{};
  Sums late_q4_{};
  uint32_t at_ = 0;
};

}  // namespace chladni
