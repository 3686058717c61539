#include "core/limits/coil_heat.hpp"

namespace chladni {

namespace {

// A rise of 2000 K and more counts as this; the numbers fit 31 bits. Where a rise leads to may be
// more.
constexpr uint32_t kMostUk = 2000000000;
constexpr uint32_t kUkPerSixteenth = 6250;  // of 0.1 K
constexpr int32_t kUkPerDk = 100000;

// Resistance of a coil over that of a cold one, 15 bits. Copper gains a = 0.393 % per kelvin. What
// is counted is the rise T0 by a cold coil's power; a warm one takes less, T (1 + aT) = T0, so that
// 1 + aT = (1 + sqrt(1 + 4 a T0)) / 2.
uint32_t resistance_q15(uint32_t rise_dk) {
  constexpr uint32_t kPerDk = 1687919;  // 4 a / 10 in 30 bits
  constexpr uint32_t kMostDk = 1900;    // the sum fits 32 bits
  const uint32_t counted = rise_dk < kMostDk ? rise_dk : kMostDk;
  return ((1U << 15) + square_root((1U << 30) + counted * kPerDk)) / 2U;
}

// A share of the way from a rise to where it leads, sixteenths of 0.1 K: one in `up`, or `down`.
int32_t step_uk(int32_t rise_uk, uint32_t target, int32_t up, int32_t down) {
  constexpr uint32_t kMost = kMostUk / kUkPerSixteenth;
  if (target <= kMost) {
    const int32_t change = static_cast<int32_t>(target * kUkPerSixteenth) - rise_uk;
    return change / (change > 0 ? up : down);
  }
  // So far away that a sixteenth more does not count.
  const uint32_t rise = static_cast<uint32_t>(rise_uk) / kUkPerSixteenth, room = kMost - rise;
  const uint32_t step = (target - rise) / static_cast<uint32_t>(up) + 1U;
  return static_cast<int32_t>((step < room ? step : room) * kUkPerSixteenth);
}

// Whatever was taken to be at a lower limit than today's may have been at today's.
void raise_assumed(PinHeat& known, uint32_t limit_dk) {
  if (known.assumed_dk == 0 || limit_dk <= known.assumed_dk) return;
  for (uint32_t& rise : known.rise_uk) {
    if (rise == PinHeat::kUnknown) continue;
    const uint32_t share = rise / known.assumed_dk + 1U, most = kMostUk / limit_dk;
    rise = (share < most ? share : most) * limit_dk;
  }
  known.assumed_dk = limit_dk;
}

}  // namespace

void CoilHeat::start(const Config& config, PinHeat& known, bool were_on) {
  *this = CoilHeat{};
  channels_ = config.channels;
  full_rise_dk_ = config.full_rise_dk;
  limit_uk_ = config.limit_rise_dk * kUkPerDk;
  heating_ms_ = config.heating_ds * 100;
  were_on_ = were_on;
  max_square_q15_ = (config.max_duty_q15 * config.max_duty_q15) >> 15;
  hot_uk_.fill(limit_uk_);
  raise_assumed(known, config.limit_rise_dk);
  for (uint32_t k = 0; k < channels_; ++k) {
    const uint32_t pin = config.pwm_pins[k];
    const uint32_t rise_uk = pin < gpio::kPins ? known.rise_uk[pin] : PinHeat::kUnknown;
    const bool is_known = rise_uk != PinHeat::kUnknown;
    // A limit that was higher since the power came may have been used up before it came.
    if (!is_known && known.assumed_dk == 0) known.assumed_dk = config.limit_rise_dk;
    rise_uk_[k] = is_known ? static_cast<int32_t>(rise_uk)
                           : static_cast<int32_t>(known.assumed_dk) * kUkPerDk;
  }
}

// What came before this start and was not counted may have been all there can be.
void CoilHeat::set_reaction(uint32_t milliseconds) {
  for (uint32_t k = 0; k < channels_; ++k) {
    const int32_t lead = lead_uk(k, milliseconds + 2U * kWindowMs);
    const int32_t room = static_cast<int32_t>(kMostUk) - rise_uk_[k];
    hot_uk_[k] = limit_uk_ - lead;
    if (were_on_) rise_uk_[k] += lead < room ? lead : room;
  }
  were_on_ = false;
}

// All in 32 bits, rounded up: a rise of 6553.5 K times 1024 fits 27.
int32_t CoilHeat::lead_uk(uint32_t channel, uint32_t reaction_ms) const {
  const uint32_t full_dk = ((full_rise_dk_[channel] * max_square_q15_) >> 15) + 1U;
  const auto heating_ms = static_cast<uint32_t>(heating_ms_);
  const uint32_t share_q10 =
      reaction_ms < heating_ms ? reaction_ms * 1024U / heating_ms + 1U : 1024U;
  const uint32_t scaled = (full_dk * share_q10 + 63U) / 64U;  // 0.1 K in sixteenths
  constexpr uint32_t kMost = kMostUk / kUkPerSixteenth;
  return static_cast<int32_t>((scaled < kMost ? scaled : kMost) * kUkPerSixteenth);
}

bool CoilHeat::add(const Squares& squares, uint32_t milliseconds) {
  for (uint32_t k = 0; k < channels_; ++k) sums_[k] += squares[k];
  // After a main loop that stood still for longer they are a little less cool than they could be.
  window_ms_ += milliseconds < 10000U ? milliseconds : 10000U;
  if (window_ms_ < kWindowMs) return false;
  for (uint32_t k = 0; k < channels_; ++k) {
    const uint32_t square_q16 = sums_[k] / window_ms_;
    // 0.1 K times 16, then in microkelvin: each step fits 32 bits.
    const uint32_t target = ((square_q16 >> 1) * full_rise_dk_[k]) >> 11;
    // Upwards a step of w/τ, a little more than the exponential one, and never past the target;
    // downwards one of w/(τ + w), a little less: both are the safe side.
    const auto window = static_cast<int32_t>(window_ms_);
    const int32_t up = heating_ms_ / window;
    const int32_t down = (heating_ms_ + window - 1) / window + 1;
    rise_uk_[k] += step_uk(rise_uk_[k], target, up > 1 ? up : 1, down);
  }
  sums_.fill(0);
  window_ms_ = 0;
  return true;
}

void CoilHeat::note(const Config& config, PinHeat& known) const {
  for (uint32_t k = 0; k < channels_; ++k) {
    const uint32_t pin = config.pwm_pins[k];
    if (pin < gpio::kPins) known.rise_uk[pin] = static_cast<uint32_t>(rise_uk_[k]);
  }
}

uint32_t CoilHeat::hot_channel() const {
  for (uint32_t k = 0; k < channels_; ++k) {
    if (rise_uk_[k] > hot_uk_[k]) return k;
  }
  return kMaxChannels;
}

void CoilHeat::even_out(Drive& drive) const {
  std::array<uint32_t, kMaxChannels> resistance{};
  uint32_t largest = 0;
  for (uint32_t k = 0; k < channels_; ++k) {
    if (drive[k].in_phase_q15 == 0 && drive[k].quadrature_q15 == 0) continue;
    resistance[k] = resistance_q15(rise_dk(k));
    if (resistance[k] > largest) largest = resistance[k];
  }
  if (largest == 0) return;
  for (uint32_t k = 0; k < channels_; ++k) {
    if (resistance[k] == largest) continue;
    drive[k] = scaled(drive[k], static_cast<int32_t>((resistance[k] << 15) / largest));
  }
}

bool CoilHeat::has_cooled() const {
  for (uint32_t k = 0; k < channels_; ++k) {
    if (rise_uk_[k] > hot_uk_[k] / 8 * 7) return false;
  }
  return true;
}

}  // namespace chladni
