#include "core/synthesis.hpp"

#include "core/generated/table_format.hpp"
#include "core/sine.hpp"

namespace chladni {

namespace {

constexpr int32_t kOneStepQ16 = 1 << 16;
// Feedback of the rounding error stops growing here; it is only reached where a duty is clipped.
constexpr int32_t kErrorLimitQ16 = 2 * kOneStepQ16;

int32_t clamp(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : (value > high ? high : value);
}

// Floor of the square root, bit by bit.
uint32_t square_root(uint32_t value) {
  uint32_t root = 0;
  for (uint32_t bit = 1U << 15; bit != 0; bit >>= 1) {
    const uint32_t trial = root | bit;
    if (trial * trial <= value) root = trial;
  }
  return root;
}

}  // namespace

const char* to_text(FadeCause cause) {
  switch (cause) {
    case FadeCause::kNone: return "none";
    case FadeCause::kReleased: return "released";
    case FadeCause::kTouchTimeout: return "touch timeout";
    case FadeCause::kMaxOn: return "on too long";
  }
  return "unknown";
}

uint32_t phase_step_u32(uint32_t frequency_mhz, uint32_t pwm_bits) {
  // f / (80 MHz / 2^bits / 4) = f_mHz * 2^(bits - 11) / 9765625; as 2^32 times that, by long
  // division, because the product needs 64 bits.
  uint32_t remainder = frequency_mhz;
  uint32_t divisor = 9765625U;
  if (pwm_bits < 11) divisor <<= 11 - pwm_bits;
  if (pwm_bits > 11) remainder <<= pwm_bits - 11;
  uint32_t quotient = 0;
  for (int bit = 0; bit < 32; ++bit) {
    remainder <<= 1;
    quotient <<= 1;
    if (remainder >= divisor) {
      remainder -= divisor;
      quotient |= 1U;
    }
  }
  return quotient + (remainder >= divisor / 2 ? 1U : 0U);
}

uint32_t samples_in(uint32_t microseconds, uint32_t pwm_bits) {
  // 80 MHz / 2^bits / 4 is 20e6 / 2^bits samples per second: 20 samples per 2^bits us.
  const uint32_t blocks = microseconds >> pwm_bits;
  const uint32_t rest = microseconds & ((1U << pwm_bits) - 1U);
  return blocks * 20U + ((rest * 20U) >> pwm_bits);
}

bool Synthesis::start(const SynthesisSettings& settings) {
  if (settings.channels < 1 || settings.channels > kMaxChannels) return false;
  if (settings.pwm_bits < 10 || settings.pwm_bits > 12) return false;
  namespace f = table_format;
  if (settings.frequency_mhz < f::kMinFrequencyMhz) return false;
  if (settings.frequency_mhz > f::kMaxFrequencyMhz) return false;
  if (settings.ramp_us > f::kMaxRampUs) return false;
  if (settings.touch_timeout_us > f::kMaxTouchTimeoutUs) return false;
  if (settings.max_on_us > f::kMaxOnUs) return false;
  settings_ = settings;
  phase_step_u32_ = phase_step_u32(settings.frequency_mhz, settings.pwm_bits);
  next_phase_step_u32_ = phase_step_u32_;
  half_span_ = static_cast<int32_t>(half_span_steps(settings.pwm_bits));
  max_duty_ = (1 << settings.pwm_bits) - 1;
  const uint32_t ramp = samples_in(settings.ramp_us, settings.pwm_bits);
  ramp_samples_ = ramp > 0 ? static_cast<int32_t>(ramp) : 1;
  timeout_samples_ = samples_in(settings.touch_timeout_us, settings.pwm_bits);
  max_on_samples_ = samples_in(settings.max_on_us, settings.pwm_bits);
  return true;
}

bool Synthesis::play(const Drive& drive, uint32_t level_q15, bool starts_touch) {
  Command command{};
  command.starts_touch = starts_touch;
  command.phase_step_u32 = next_phase_step_u32_;
  const auto level = static_cast<int32_t>(level_q15 > 32767U ? 32767U : level_q15);
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    int32_t in_phase = (drive[k].in_phase_q15 * level) >> 15;
    int32_t quadrature = (drive[k].quadrature_q15 * level) >> 15;
    auto size = square_root(static_cast<uint32_t>(in_phase * in_phase) +
                            static_cast<uint32_t>(quadrature * quadrature));
    if (size > 32767U) {
      // A damaged drive may ask for up to sqrt(2) of full scale; it gets full scale.
      in_phase = in_phase * 32767 / static_cast<int32_t>(size + 1);
      quadrature = quadrature * 32767 / static_cast<int32_t>(size + 1);
      size = 32767U;
    }
    command.in_phase_q30[k] = in_phase * (1 << 15);
    command.quadrature_q30[k] = quadrature * (1 << 15);
    // A silent channel needs no bias; any other needs its amplitude, rounded up, and the margin.
    if (size > 0) {
      const int32_t amplitude_q16 = static_cast<int32_t>(size + 1) * half_span_ * 2;
      command.bias_q16[k] = amplitude_q16 + static_cast<int32_t>(kBiasMarginSteps) * kOneStepQ16;
    }
  }
  return post(command);
}

bool Synthesis::set_frequency(uint32_t frequency_mhz) {
  namespace f = table_format;
  if (frequency_mhz < f::kMinFrequencyMhz || frequency_mhz > f::kMaxFrequencyMhz) return false;
  next_phase_step_u32_ = phase_step_u32(frequency_mhz, settings_.pwm_bits);
  return true;
}

bool Synthesis::release() {
  Command command{};
  command.is_release = true;
  return post(command);
}

bool Synthesis::post(const Command& command) {
  if (command_waits_.load(std::memory_order_acquire)) return false;
  command_ = command;
  // What ended the last touch must not be taken for the end of this one.
  if (command.starts_touch) fade_cause_.store(FadeCause::kNone, std::memory_order_relaxed);
  command_waits_.store(true, std::memory_order_release);
  return true;
}

void Synthesis::keep_alive() {
  // One writer, so a plain load and store count correctly without a read-modify-write.
  beats_.store(beats_.load(std::memory_order_relaxed) + 1U, std::memory_order_release);
}

void Synthesis::sample(const Hal& hal) {
  if (command_waits_.load(std::memory_order_acquire)) {
    take(command_);
    command_waits_.store(false, std::memory_order_release);
  }
  if (output_.load(std::memory_order_relaxed) == Output::kOff) {
    for (uint32_t k = 0; k < settings_.channels; ++k) hal.set_duty(hal.context, k, 0);
    return;
  }
  watch_deadlines();
  if (ramp_left_ > 0) {
    --ramp_left_;
    for (uint32_t k = 0; k < settings_.channels; ++k) {
      Channel& channel = channels_[k];
      for (Ramp* ramp : {&channel.in_phase_q30, &channel.quadrature_q30, &channel.bias_q16}) {
        ramp->value = ramp_left_ == 0 ? ramp->end : ramp->value + ramp->step;
      }
    }
  } else if (output_.load(std::memory_order_relaxed) == Output::kFading) {
    for (Channel& channel : channels_) channel = Channel{};
    output_.store(Output::kOff, std::memory_order_release);
    for (uint32_t k = 0; k < settings_.channels; ++k) hal.set_duty(hal.context, k, 0);
    return;
  }
  const SineCosine wave = sine_cosine(phase_u32_);
  phase_u32_ += phase_step_u32_;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    hal.set_duty(hal.context, k, shape(channels_[k], wave));
  }
}

uint32_t Synthesis::shape(Channel& channel, const SineCosine& wave) const {
  const int32_t value_q30 = (channel.in_phase_q30.value >> 15) * wave.cosine_q15 -
                            (channel.quadrature_q30.value >> 15) * wave.sine_q15;
  // Q19 times at most 11 bits of span fit; three bits less make Q16 duty steps.
  const int32_t swing_q16 = ((value_q30 >> 11) * half_span_) >> 3;
  const int32_t wanted_q16 = channel.bias_q16.value + swing_q16;
  const int32_t fed_q16 = wanted_q16 + 2 * channel.error_q16 - channel.older_error_q16;
  const int32_t duty = clamp((fed_q16 + kOneStepQ16 / 2) >> 16, 0, max_duty_);
  channel.older_error_q16 = channel.error_q16;
  channel.error_q16 = clamp(fed_q16 - duty * kOneStepQ16, -kErrorLimitQ16, kErrorLimitQ16);
  return static_cast<uint32_t>(duty);
}

void Synthesis::take(const Command& command) {
  if (command.is_release) {
    if (output_.load(std::memory_order_relaxed) == Output::kPlaying) fade(FadeCause::kReleased);
    return;
  }
  const Output output = output_.load(std::memory_order_relaxed);
  // A move comes too late once a deadline has ended its touch: only a new touch starts the clock.
  if (!command.starts_touch && output != Output::kPlaying) return;
  if (command.starts_touch) {
    on_samples_ = 0;
    phase_step_u32_ = command.phase_step_u32;
  }
  // From silence every wave starts at the same phase, so the same touch plays the same.
  if (output == Output::kOff) phase_u32_ = 0;
  quiet_samples_ = 0;
  ramp_left_ = ramp_samples_;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    aim(channels_[k].in_phase_q30, command.in_phase_q30[k]);
    aim(channels_[k].quadrature_q30, command.quadrature_q30[k]);
    aim(channels_[k].bias_q16, command.bias_q16[k]);
  }
  output_.store(Output::kPlaying, std::memory_order_release);
}

void Synthesis::fade(FadeCause cause) {
  ramp_left_ = ramp_samples_;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    aim(channels_[k].in_phase_q30, 0);
    aim(channels_[k].quadrature_q30, 0);
    aim(channels_[k].bias_q16, 0);
  }
  fade_cause_.store(cause, std::memory_order_release);
  output_.store(Output::kFading, std::memory_order_release);
}

void Synthesis::aim(Ramp& ramp, int32_t end) const {
  ramp.end = end;
  // Ends are at most 2^30 in size, so the way between two of them fits 32 bits.
  ramp.step = (end - ramp.value) / ramp_samples_;
}

void Synthesis::watch_deadlines() {
  const uint32_t beats = beats_.load(std::memory_order_acquire);
  quiet_samples_ = beats == seen_beats_ ? quiet_samples_ + 1 : 0;
  seen_beats_ = beats;
  ++on_samples_;
  if (output_.load(std::memory_order_relaxed) != Output::kPlaying) return;
  if (on_samples_ >= max_on_samples_) {
    fade(FadeCause::kMaxOn);
  } else if (quiet_samples_ >= timeout_samples_) {
    fade(FadeCause::kTouchTimeout);
  }
}

}  // namespace chladni
