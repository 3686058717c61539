#include "core/device/coil_heat.hpp"

namespace chladni {

namespace {

// A rise of 2000 K and more counts as this; the numbers fit 31 bits.
constexpr uint32_t kMostUk = 2000000000;
constexpr int32_t kUkPerDk = 100000;

}  // namespace

void CoilHeat::start(const Config& config, bool is_warm) {
  *this = CoilHeat{};
  channels_ = config.channels;
  full_current_ma_ = config.full_current_ma;
  full_rise_dk_ = config.full_rise_dk;
  limit_uk_ = config.limit_rise_dk * kUkPerDk;
  heating_ms_ = config.heating_ds * 100;
  if (is_warm) rise_uk_.fill(limit_uk_ / 2);
}

void CoilHeat::add(const Loads& loads, uint32_t milliseconds) {
  // A main loop that stood still for long counts as a second: sums fit, and outputs were off.
  const uint32_t passed = milliseconds < 1000U ? milliseconds : 1000U;
  for (uint32_t k = 0; k < channels_; ++k) {
    sums_[k].mean_q16 += loads[k].mean_q16 * passed;
    sums_[k].square_q16 += loads[k].square_q16 * passed;
  }
  window_ms_ += passed;
  if (window_ms_ < kWindowMs) return;
  uint32_t supply_ma = 0;
  for (uint32_t k = 0; k < channels_; ++k) {
    supply_ma += ((sums_[k].mean_q16 / window_ms_) * full_current_ma_[k]) >> 16;
    const uint32_t square_q16 = sums_[k].square_q16 / window_ms_;
    // 0.1 K times 16, then in microkelvin: each step fits 32 bits.
    const uint32_t target = ((square_q16 >> 1) * full_rise_dk_[k]) >> 11;
    constexpr uint32_t kMost = kMostUk / 6250;
    const auto target_uk = static_cast<int32_t>((target < kMost ? target : kMost) * 6250U);
    // The straight step is a little more than the exponential one, which is the safe side, and
    // never passes the target.
    const int32_t steps = heating_ms_ / static_cast<int32_t>(window_ms_);
    rise_uk_[k] += (target_uk - rise_uk_[k]) / (steps > 1 ? steps : 1);
  }
  supply_ma_ = supply_ma;
  sums_.fill({0, 0});
  window_ms_ = 0;
}

uint32_t CoilHeat::hot_channel() const {
  for (uint32_t k = 0; k < channels_; ++k) {
    if (rise_uk_[k] > limit_uk_) return k;
  }
  return kMaxChannels;
}

bool CoilHeat::has_cooled() const {
  for (uint32_t k = 0; k < channels_; ++k) {
    if (rise_uk_[k] > limit_uk_ / 4 * 3) return false;
  }
  return true;
}

}  // namespace chladni
