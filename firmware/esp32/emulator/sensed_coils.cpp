#include "emulator/sensed_coils.hpp"

#include "core/sensing/expander.hpp"

#include <cmath>

namespace chladni::emulator {

namespace {

constexpr uint32_t kClockBits = 12;       // 80 MHz / 2^12 are samples …
constexpr uint32_t kConversionBits = 10;  // … and 80 MHz / 2^10 conversions
constexpr uint32_t kConversions = 4;
constexpr double kClockHz = 80e6, kPi = 3.14159265358979323846;
constexpr double kFarAway = 1e6;  // steps
// The amplifier's 1.3 V, of a converter that reads 3.1 V as 4096.
constexpr double kMiddle = 1717.7, kHighest = 4095.0, kHalf = 2048.0;
constexpr uint32_t kLevels = 2, kAwake = 3, kDirections = 6;

// A pulse from each carrier period's begin, of so much of it; the other way round where a bridge's
// sign is set. `turns`: of the period that have passed.
double left_of_carrier(const std::complex<double>* residues, double duty, double turns) {
  const double sign = duty < 0.0 ? -1.0 : 1.0;
  const std::complex<double> turn(0.0, -2.0 * kPi);
  double sum = 0.0;
  for (uint32_t k = 0; k < kHarmonics; ++k) {
    const double harmonic = k + 1.0;
    const std::complex<double> pulse = (1.0 - std::exp(turn * harmonic * std::abs(duty))) /
                                       (harmonic * kPi) * std::complex<double>(0.0, -1.0);
    sum += std::real(residues[k] * pulse * std::exp(-turn * harmonic * turns));
  }
  return sign * sum;
}

}  // namespace

void SensedCoils::set_responses(uint32_t channels, std::vector<float> responses,
                                std::vector<std::complex<double>> carrier, uint32_t late,
                                double noise, double bend, double begin_us, uint32_t seed) {
  channels_ = channels;
  length_ =
      channels == 0
          ? 0U
          : static_cast<uint32_t>(responses.size() / (channels + 1U) / channels / kConversions);
  responses_ = std::move(responses);
  carrier_ = std::move(carrier);
  late_ = late;
  noise_ = noise;
  bend_ = bend;
  begin_us_ = begin_us;
  random_ = Noise(seed);
  for (uint32_t k = 0; k < channels; ++k) duties_[k].assign(2 * length_, 0.0F);
  silent_for_.fill(length_);
  newest_ = 0;
}

BusStatus SensedCoils::transfer(const uint8_t* written, uint32_t count) {
  if (faults_.is_expander_absent) return BusStatus::kNoAnswer;
  // Writes go on in the other register of a pair.
  for (uint32_t k = 1; k < count; ++k) {
    registers_[((written[0] & 6U) | ((written[0] + k - 1U) & 1U)) % registers_.size()] = written[k];
  }
  return BusStatus::kOk;
}

bool SensedCoils::start(uint64_t period, const Pwm& pwm) {
  if (faults_.is_converter_dead) return false;
  is_listening_ = true;
  has_lost_ = false;
  values_.clear();
  from_period_ = period + (static_cast<uint64_t>(begin_us_ * 80.0) >> pwm.bits());
  return true;
}

void SensedCoils::stop() {
  is_listening_ = false;
  values_.clear();
}

uint32_t SensedCoils::heard(uint16_t* values, uint32_t most) {
  if (has_lost_ || !is_listening_) return kValuesLost;
  uint32_t count = 0;
  for (; count < most && !values_.empty(); ++count) {
    values[count] = values_.front();
    values_.pop_front();
  }
  return count;
}

// A bridge sleeps where its line is low; pull-ups hold the lines that the expander does not drive.
bool SensedCoils::is_awake(uint32_t channel, const Pwm& pwm) const {
  if (!pwm.has_signs() || channel >= 8U) return true;
  const uint32_t low = static_cast<uint32_t>(~registers_[kAwake] & ~registers_[kDirections + 1U]);
  return ((low >> channel) & 1U) == 0;
}

void SensedCoils::remember(const Pwm& pwm) {
  newest_ = newest_ == 0 ? length_ - 1U : newest_ - 1U;
  for (uint32_t k = 0; k < channels_; ++k) {
    const double duty =
        is_awake(k, pwm) ? pwm.latched(k) / static_cast<double>(1U << pwm.bits()) : 0.0;
    duties_[k][newest_] = duties_[k][newest_ + length_] = static_cast<float>(duty);
    silent_for_[k] = duty == 0.0 ? silent_for_[k] + 1U : 0U;
  }
}

void SensedCoils::respond(uint64_t clock, const Pwm& pwm) {
  steps_.fill(0.0);
  const uint32_t period = 1U << pwm.bits();
  const uint32_t driven = static_cast<uint32_t>(~registers_[kDirections]) & 31U;
  const uint32_t lines = registers_[kLevels] & driven;
  const bool is_reference = (lines & expander::kReference) != 0;
  const uint32_t heard = is_reference ? channels_ : (lines & 15U) | faults_.stuck_address;
  if (faults_.is_pin_open || heard > channels_ || (heard == channels_ && !is_reference)) return;
  if (is_reference) {
    // Through resistors that no driver minds.
  } else if (pwm.has_signs()) {
    // Its own bridge brakes it.
    if (is_awake(heard, pwm)) return;
  } else if (pwm.latched(heard) != 0) {
    steps_.fill(kFarAway);  // a switch pulls at it
    return;
  }
  for (uint32_t k = 0; k < channels_; ++k) {
    if (silent_for_[k] >= length_) continue;
    const float* own = &responses_[(heard * channels_ + k) * kConversions * length_];
    const float* const duty = &duties_[k][newest_];
    const std::complex<double>* const carrier = &carrier_[(heard * channels_ + k) * kHarmonics];
    const auto late = static_cast<double>(duty[late_]);
    for (uint32_t n = 0; n < kConversions; ++n) {
      float part = 0.0F;
      for (uint32_t age = 0; age < length_; ++age) part += own[age] * duty[age];
      const uint64_t now = clock + (uint64_t{n} << kConversionBits);
      const double turns = static_cast<double>(now & (period - 1U)) / period;
      steps_[n] += static_cast<double>(part) + left_of_carrier(carrier, late, turns);
      own += length_;
    }
  }
  if (is_reference) return;
  for (uint32_t n = 0; n < kConversions; ++n) {
    steps_[n] += bumped(clock + (uint64_t{n} << kConversionBits));
  }
}

double SensedCoils::bumped(uint64_t clock) const {
  if (bump_.steps == 0.0 || clock < bump_.from) return 0.0;
  const double since_s = static_cast<double>(clock - bump_.from) / kClockHz;
  return bump_.steps * std::exp(-since_s / bump_.decay_s) *
         std::sin(2.0 * kPi * bump_.hz * since_s);
}

double SensedCoils::answer(const std::vector<float>& responses) const {
  if (responses.size() != response_size()) return 0.0;
  double sum = 0.0;
  for (uint32_t k = 0; k < channels_; ++k) {
    if (silent_for_[k] >= length_) continue;
    const float* const own = &responses[size_t{k} * length_];
    const float* const duty = &duties_[k][newest_];
    for (uint32_t n = 0; n < length_; ++n) sum += static_cast<double>(own[n] * duty[n]);
  }
  return sum;
}

uint16_t SensedCoils::convert(double steps) {
  const double noise = noise_ * random_.next();
  const double place = steps < -kHalf ? -0.5 : (steps > kHalf ? 0.5 : steps / (2.0 * kHalf));
  // A cubic that leaves both ends and the middle where they are.
  const double bend = bend_ * (4.0 * place * place * place - place) / 0.19;
  const double value = std::nearbyint(kMiddle + steps + bend + noise);
  return static_cast<uint16_t>(value < 0.0 ? 0.0 : (value > kHighest ? kHighest : value));
}

void SensedCoils::begin_period(uint64_t period, const Pwm& pwm) {
  if (length_ == 0 || channels_ != pwm.channels()) {
    if (!is_listening_) return;
  } else if ((period << pwm.bits()) % (1U << kClockBits) == 0) {
    remember(pwm);
    if (is_listening_) respond(period << pwm.bits(), pwm);
  }
  if (!is_listening_ || period < from_period_) return;
  const auto first = static_cast<uint32_t>((period << pwm.bits()) >> kConversionBits);
  for (uint32_t k = 0; k < 1U << (pwm.bits() - kConversionBits); ++k) {
    if (faults_.lost_values > 0) {
      --faults_.lost_values;
    } else if (values_.size() < kKeptValues) {
      values_.push_back(convert(steps_[(first + k) % kConversions]));
    } else {
      has_lost_ = true;
    }
  }
}

}  // namespace chladni::emulator
