#include "core/coil_heat.hpp"

namespace chladni {

namespace {

// A rise of 2000 K and more counts as this; the numbers fit 31 bits.
constexpr int32_t kMostUk = 2000000000;
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

void CoilHeat::update(const Meter& meter, uint32_t now_us) {
  if (!has_last_) {
    last_ = meter;
    last_us_ = now_us;
    has_last_ = true;
    return;
  }
  const uint32_t passed_us = now_us - last_us_;
  const uint32_t samples = (meter.samples - last_.samples) / channels_;
  if (passed_us < kWindowUs || samples == 0) return;
  const auto passed_ms = static_cast<int32_t>(passed_us / 1000U);
  uint32_t supply_ma = 0;
  for (uint32_t k = 0; k < channels_; ++k) {
    const uint32_t mean_q16 = (meter.duty_q16[k] - last_.duty_q16[k]) / samples;
    uint32_t square_q16 = (meter.square_q16[k] - last_.square_q16[k]) / samples;
    if (square_q16 > 65536U) square_q16 = 65536U;
    supply_ma += (mean_q16 * full_current_ma_[k]) >> 16;
    // 0.1 K times 2^16 fits; 100000 / 2^16 of it, in two steps, is in microkelvin.
    const uint32_t target = ((square_q16 >> 1) * full_rise_dk_[k]) >> 11;  // 0.1 K times 16
    const int32_t most = kMostUk / 6250;
    const int32_t target_uk =
        (static_cast<int32_t>(target) > most ? most : static_cast<int32_t>(target)) * 6250;
    // The exact step of a longer pause would be less: this errs to neither side by much as long as
    // windows are short against the time constant, and never passes the target.
    const int32_t steps = heating_ms_ / passed_ms;
    rise_uk_[k] += (target_uk - rise_uk_[k]) / (steps > 1 ? steps : 1);
  }
  supply_ma_ = supply_ma;
  last_ = meter;
  last_us_ = now_us;
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
