#include "core/synthesis.hpp"

#include "core/generated/table_format.hpp"
#include "core/sine.hpp"

namespace chladni {

namespace {

constexpr int32_t kUnityQ30 = 1 << 30;
// Feedback of the rounding error stops growing here, in duty steps; it is only reached where a duty
// is clipped.
constexpr int32_t kMostErrorSteps = 2;
// A ramp of fewer samples would need a factor beyond 15 bits.
constexpr uint32_t kShortestRamp = 4;

int32_t clamp(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : (value > high ? high : value);
}

// Phase of x + iy, from 0 to one turn, to 2^-17 turns: halves the quarter until it is found.
uint32_t phase_of(int32_t x, int32_t y) {
  uint32_t turned = 0;
  while (x < 0 || y < 0 || (x == 0 && y != 0)) {
    const int32_t old_x = x;
    x = y;
    y = -old_x;
    turned += 0x40000000U;
  }
  uint32_t phase = 0;
  for (uint32_t half = 0x20000000U; half >= 0x8000U; half >>= 1) {
    const SineCosine trial = sine_cosine(phase + half);
    if (trial.sine_q15 * x <= trial.cosine_q15 * y) phase += half;
  }
  return phase + turned;
}

}  // namespace

const char* to_text(FadeCause cause) {
  switch (cause) {
    case FadeCause::kNone: return "none";
    case FadeCause::kReleased: return "released";
    case FadeCause::kTouchTimeout: return "touch timeout";
    case FadeCause::kMaxOn: return "on too long";
    case FadeCause::kLate: return "interrupt late";
    case FadeCause::kUnderrun: return "stream underrun";
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
  if (settings.limits.max_duty_q15 > 32768U) return false;
  settings_ = settings;
  phase_step_u32_ = phase_step_u32(settings.frequency_mhz, settings.pwm_bits);
  next_phase_step_u32_ = phase_step_u32_;
  fraction_bits_ = 30U - settings.pwm_bits;
  const uint32_t ceiling = (settings.limits.max_duty_q15 << settings.pwm_bits) >> 15;
  max_duty_ = static_cast<int32_t>(ceiling) - (settings.limits.max_duty_q15 == 32768U ? 1 : 0);
  fade_rate_ = ramp_rate(settings.ramp_us);
  timeout_samples_ = samples_in(settings.touch_timeout_us, settings.pwm_bits);
  max_on_samples_ = samples_in(settings.max_on_us, settings.pwm_bits);
  late_samples_ = samples_in(kMostLateUs, settings.pwm_bits);
  stream_.start(settings.channels);
  return true;
}

Synthesis::RampRate Synthesis::ramp_rate(uint32_t ramp_us) const {
  uint32_t samples = samples_in(ramp_us, settings_.pwm_bits);
  if (samples < kShortestRamp) samples = kShortestRamp;
  RampRate rate;
  rate.samples = static_cast<int32_t>(samples);
  // 65536 / samples as a factor of 15 bits and a shift.
  while ((65536U << rate.shift) / samples < (1U << 14)) ++rate.shift;
  rate.factor = static_cast<int32_t>((65536U << rate.shift) / samples);
  return rate;
}

uint32_t Synthesis::fitting_level(const std::array<uint32_t, kMaxChannels>& sizes,
                                  uint32_t level_q15) {
  const OutputLimits& limits = settings_.limits;
  const uint32_t half_span = half_span_steps(settings_.pwm_bits);
  const uint32_t rest = kBiasMarginSteps + limits.min_on_steps;
  // In duty steps: what the largest channel peaks at, and every channel's mean times its current.
  uint32_t largest = 0, mean_sum = 0, rest_sum = 0;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    const uint32_t amplitude = (((sizes[k] * level_q15) >> 15) * half_span >> 15) + 1U;
    if (amplitude > largest) largest = amplitude;
    mean_sum += amplitude * limits.full_current_ma[k];
    if (sizes[k] > 0) rest_sum += rest * limits.full_current_ma[k];
  }
  uint32_t level = level_q15;
  const uint32_t peak_room = (static_cast<uint32_t>(max_duty_) - rest - kBiasMarginSteps) / 2U;
  if (largest > peak_room) level = share_of(level_q15, peak_room, largest);
  if (limits.supply_ma > 0) {
    const uint32_t allowed = limits.supply_ma << settings_.pwm_bits;
    const uint32_t room = allowed > rest_sum ? allowed - rest_sum : 0U;
    const uint32_t fitting = mean_sum > room ? share_of(level_q15, room, mean_sum) : level_q15;
    if (fitting < level) level = fitting;
  }
  if (level < level_q15) ++limited_;
  return level;
}

bool Synthesis::play(const Drive& drive, const PlayOptions& options) {
  if (command_waits_.load(std::memory_order_acquire)) return false;
  Command command{};
  command.kind = Kind::kDrive;
  command.starts_touch = options.starts_touch;
  command.rate = ramp_rate(options.ramp_us);
  command.phase_step_u32 = next_phase_step_u32_;
  command.edges = EdgeScale::of(next_phase_step_u32_);
  command.waveform = options.starts_touch ? next_waveform_ : command_.waveform;
  std::array<uint32_t, kMaxChannels> sizes{};
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    const int32_t in_phase = drive[k].in_phase_q15, quadrature = drive[k].quadrature_q15;
    sizes[k] = square_root(static_cast<uint32_t>(in_phase * in_phase) +
                           static_cast<uint32_t>(quadrature * quadrature));
  }
  const auto level = static_cast<int32_t>(
      fitting_level(sizes, options.level_q15 > 32767U ? 32767U : options.level_q15));
  // Gains times this are duty steps with `fraction_bits_`.
  const auto half_span = static_cast<int32_t>(half_span_steps(settings_.pwm_bits));
  const uint32_t shift = fraction_bits_ - 15U;
  const auto rest = static_cast<int32_t>(kBiasMarginSteps + settings_.limits.min_on_steps);
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    int32_t in_phase = (drive[k].in_phase_q15 * level) >> 15;
    int32_t quadrature = (drive[k].quadrature_q15 * level) >> 15;
    auto size = static_cast<int32_t>((sizes[k] * static_cast<uint32_t>(level)) >> 15);
    if (size > kOneQ15) {
      // A damaged drive may ask for up to sqrt(2) of full scale; it gets full scale.
      in_phase = in_phase * kOneQ15 / (size + 1);
      quadrature = quadrature * kOneQ15 / (size + 1);
      size = kOneQ15;
    }
    if (command.waveform == Waveform::kSine) {
      command.first[k] = in_phase * half_span * (1 << shift);
      command.second[k] = quadrature * half_span * (1 << shift);
    } else {
      command.first[k] = size * half_span * (1 << shift);
      command.second[k] = static_cast<int32_t>(phase_of(in_phase, quadrature));
    }
    // A silent channel needs no bias; any other needs its amplitude, rounded up, and the rest.
    if (sizes[k] > 0 && level > 0) {
      command.bias[k] = (size + 1) * half_span * (1 << shift) + rest * (1 << fraction_bits_);
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

bool Synthesis::set_waveform(Waveform waveform) {
  if (static_cast<uint32_t>(waveform) >= kWaveforms) return false;
  next_waveform_ = waveform;
  return true;
}

bool Synthesis::play_stream() {
  if (command_waits_.load(std::memory_order_acquire)) return false;
  Command command{};
  command.kind = Kind::kStream;
  command.starts_touch = true;
  command.rate = fade_rate_;
  return post(command);
}

bool Synthesis::release(uint32_t ramp_us) {
  if (command_waits_.load(std::memory_order_acquire)) return false;
  Command command{};
  command.kind = Kind::kRelease;
  command.waveform = command_.waveform;
  command.rate = ramp_rate(ramp_us);
  return post(command);
}

bool Synthesis::post(const Command& command) {
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

Meter Synthesis::meter() const {
  Meter meter;
  meter.samples = metered_.load(std::memory_order_relaxed);
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    meter.duty_q16[k] = duty_sums_[k].load(std::memory_order_relaxed);
    meter.square_q16[k] = square_sums_[k].load(std::memory_order_relaxed);
  }
  return meter;
}

void Synthesis::sample(const Hal& hal, uint32_t missed) {
  if (missed != 0) catch_up(missed);
  if (command_waits_.load(std::memory_order_acquire)) {
    if (can_take(command_)) {
      take(command_);
      command_waits_.store(false, std::memory_order_release);
    } else if (output_.load(std::memory_order_relaxed) == Output::kPlaying && ramp_left_ == 0 &&
               (is_stream_ || command_.waveform != waveform_ || command_.kind == Kind::kStream)) {
      fade(FadeCause::kReleased);  // what is playing makes room
    }
  }
  const Output output = output_.load(std::memory_order_relaxed);
  if (output == Output::kOff) {
    switch_off(hal);
    return;
  }
  watch_deadlines();
  bool is_ramping = ramp_left_ > 0;
  if (is_ramping) {
    --ramp_left_;
    if (ramp_left_ == 0) {
      land();
      is_ramping = false;
    }
  } else if (output == Output::kFading) {
    for (uint32_t k = 0; k < settings_.channels; ++k) channels_[k] = Channel{};
    stream_gain_ = Ramp{};
    is_stream_ = false;
    output_.store(Output::kOff, std::memory_order_release);
    switch_off(hal);
    return;
  }
  Duties duties;
  if (is_stream_) {
    streamed(duties);
  } else if (waveform_ == Waveform::kSine) {
    if (is_ramping) {
      sines<true>(duties);
    } else {
      sines<false>(duties);
    }
  } else if (is_ramping) {
    others<true>(duties);
  } else {
    others<false>(duties);
  }
  phase_u32_ += phase_step_u32_;
  measure(duties);
  hal.set_duties(hal.context, duties.data(), settings_.channels);
}

void Synthesis::switch_off(const Hal& hal) {
  const Duties silence{};
  hal.set_duties(hal.context, silence.data(), settings_.channels);
  metered_.store(metered_.load(std::memory_order_relaxed) + 1U, std::memory_order_relaxed);
}

template <bool kIsRamping>
void Synthesis::sines(Duties& duties) {
  const SineCosine wave = sine_cosine(phase_u32_);
  uint32_t* duty = duties.data();
  Channel* const end = channels_.data() + settings_.channels;
  for (Channel* channel = channels_.data(); channel != end; ++channel, ++duty) {
    if (kIsRamping) {
      channel->first.value += channel->first.step;
      channel->second.value += channel->second.step;
      channel->bias.value += channel->bias.step;
    }
    const int32_t swing = (channel->first.value >> 15) * wave.cosine_q15 -
                          (channel->second.value >> 15) * wave.sine_q15;
    *duty = shape(*channel, channel->bias.value + swing);
  }
}

template <bool kIsRamping>
void Synthesis::others(Duties& duties) {
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    Channel& channel = channels_[k];
    int32_t swing = 0;
    if (kIsRamping) {
      channel.first.value += channel.first.step;
      channel.second.value += channel.second.step;
      channel.bias.value += channel.bias.step;
      swing = (channel.second.value >> 15) * wave_q15(phase_u32_ + channel.older_phase);
    }
    swing += (channel.first.value >> 15) * wave_q15(phase_u32_ + channel.phase);
    duties[k] = shape(channel, channel.bias.value + swing);
  }
}

int32_t Synthesis::wave_q15(uint32_t phase_u32) const {
  if (waveform_ == Waveform::kTriangle) return triangle_q15(phase_u32);
  if (waveform_ == Waveform::kSquare) return square_q15(phase_u32, edges_);
  return ramp_q15(phase_u32, edges_);
}

void Synthesis::streamed(Duties& duties) {
  if (ramp_left_ > 0) stream_gain_.value += stream_gain_.step;
  if (!stream_.next(duties.data()) && output_.load(std::memory_order_relaxed) == Output::kPlaying) {
    fade(FadeCause::kUnderrun);
  }
  const int32_t gain_q15 = stream_gain_.value >> 15;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    // A duty of 16 bits halved times a gain of 15 is one with 30 bits: a step has the rest.
    duties[k] = shape(channels_[k], static_cast<int32_t>(duties[k] >> 1) * gain_q15);
  }
}

uint32_t Synthesis::shape(Channel& channel, int32_t wanted) const {
  const int32_t half = 1 << (fraction_bits_ - 1U);
  const int32_t fed = wanted + 2 * channel.error - channel.older_error + half;
  const int32_t duty = fed >> fraction_bits_;
  const int32_t error = (fed & (2 * half - 1)) - half;
  channel.older_error = channel.error;
  if (static_cast<uint32_t>(duty) > static_cast<uint32_t>(max_duty_)) {
    return clip(channel, duty, error);
  }
  channel.error = error;
  return static_cast<uint32_t>(duty);
}

uint32_t Synthesis::clip(Channel& channel, int32_t duty, int32_t error) const {
  const int32_t clipped = duty < 0 ? 0 : max_duty_;
  const int32_t over = clamp(duty - clipped, -kMostErrorSteps, kMostErrorSteps);
  const int32_t most = kMostErrorSteps << fraction_bits_;
  channel.error = clamp(over * (1 << fraction_bits_) + error, -most, most);
  return static_cast<uint32_t>(clipped);
}

bool Synthesis::can_take(const Command& command) const {
  const Output output = output_.load(std::memory_order_relaxed);
  if (output == Output::kOff || command.kind == Kind::kRelease) return true;
  if (command.kind == Kind::kStream || (is_stream_ && command.starts_touch)) return false;
  if (command.starts_touch && command.waveform != waveform_) return false;
  // Only two drives can be faded at once.
  return waveform_ == Waveform::kSine || ramp_left_ == 0;
}

void Synthesis::take(const Command& command) {
  const Output output = output_.load(std::memory_order_relaxed);
  if (command.kind == Kind::kRelease) {
    if (output == Output::kPlaying) {
      rate_ = command.rate;
      fade(FadeCause::kReleased);
    }
    return;
  }
  // A move comes too late once a deadline has ended its touch: only a new touch starts the clock.
  if (!command.starts_touch && (output != Output::kPlaying || is_stream_)) return;
  if (command.starts_touch) {
    on_samples_ = 0;
    phase_step_u32_ = command.phase_step_u32;
    waveform_ = command.waveform;
    edges_ = command.edges;
  }
  // From silence every wave starts at the same phase, so the same touch plays the same.
  if (output == Output::kOff) phase_u32_ = 0;
  quiet_samples_ = 0;
  rate_ = command.rate;
  ramp_left_ = rate_.samples;
  output_.store(Output::kPlaying, std::memory_order_release);
  if (command.kind == Kind::kStream) {
    is_stream_ = true;
    aim(stream_gain_, kUnityQ30);
    return;
  }
  const bool is_sine = waveform_ == Waveform::kSine;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    Channel& channel = channels_[k];
    if (!is_sine) {
      channel.second.value = channel.first.value;
      channel.older_phase = channel.phase;
      channel.first.value = 0;
      channel.phase = static_cast<uint32_t>(command.second[k]);
    }
    aim(channel.first, command.first[k]);
    aim(channel.second, is_sine ? command.second[k] : 0);
    aim(channel.bias, command.bias[k]);
  }
}

void Synthesis::fade(FadeCause cause) {
  if (cause != FadeCause::kReleased) rate_ = fade_rate_;
  ramp_left_ = rate_.samples;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    aim(channels_[k].first, 0);
    aim(channels_[k].second, 0);
    aim(channels_[k].bias, 0);
  }
  aim(stream_gain_, 0);
  fade_cause_.store(cause, std::memory_order_release);
  output_.store(Output::kFading, std::memory_order_release);
}

void Synthesis::aim(Ramp& ramp, int32_t end) const {
  ramp.end = end;
  // What the rounding leaves, an eighth of a duty step at 10 bits, `land` makes up for.
  ramp.step = (((end - ramp.value) >> 16) * rate_.factor) >> rate_.shift;
}

void Synthesis::land() {
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    Channel& channel = channels_[k];
    channel.first.value = channel.first.end;
    channel.second.value = channel.second.end;
    channel.bias.value = channel.bias.end;
  }
  stream_gain_.value = stream_gain_.end;
}

void Synthesis::catch_up(uint32_t missed) {
  missed_.store(missed_.load(std::memory_order_relaxed) + missed, std::memory_order_relaxed);
  const Output output = output_.load(std::memory_order_relaxed);
  if (output == Output::kOff) return;
  phase_u32_ += phase_step_u32_ * missed;
  quiet_samples_ += missed;
  on_samples_ += missed;
  if (missed >= late_samples_ && output == Output::kPlaying) fade(FadeCause::kLate);
}

void Synthesis::watch_deadlines() {
  const uint32_t beats = beats_.load(std::memory_order_acquire);
  quiet_samples_ = beats == seen_beats_ ? quiet_samples_ + 1 : 0;
  seen_beats_ = beats;
  ++on_samples_;
  if (output_.load(std::memory_order_relaxed) != Output::kPlaying) return;
  // A stream may outlast a touch; coil heat ends it where it must (device.cpp).
  if (on_samples_ >= max_on_samples_ && !is_stream_) {
    fade(FadeCause::kMaxOn);
  } else if (quiet_samples_ >= timeout_samples_) {
    fade(FadeCause::kTouchTimeout);
  }
}

void Synthesis::measure(const Duties& duties) {
  const uint32_t k = metered_channel_;
  metered_channel_ = k + 1U < settings_.channels ? k + 1U : 0U;
  const uint32_t duty_q16 = duties[k] << (16U - settings_.pwm_bits);
  const uint32_t half_q15 = duty_q16 >> 1;
  duty_sums_[k].store(duty_sums_[k].load(std::memory_order_relaxed) + duty_q16,
                      std::memory_order_relaxed);
  square_sums_[k].store(
      square_sums_[k].load(std::memory_order_relaxed) + ((half_q15 * half_q15) >> 14),
      std::memory_order_relaxed);
  metered_.store(metered_.load(std::memory_order_relaxed) + 1U, std::memory_order_relaxed);
}

}  // namespace chladni
