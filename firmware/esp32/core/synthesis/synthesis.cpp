#include "core/synthesis/synthesis.hpp"

#include "core/generated/table_format.hpp"
#include "core/synthesis/sine.hpp"

namespace chladni {

namespace {

using Kind = Command::Kind;

// A ramp of fewer samples would need a factor beyond 15 bits.
constexpr uint32_t kShortestRamp = 4;

Load larger(const Load& one, const Load& other) {
  return {one.mean_q16 > other.mean_q16 ? one.mean_q16 : other.mean_q16,
          one.square_q16 > other.square_q16 ? one.square_q16 : other.square_q16};
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

// Of what is rounded to duty steps: 30 bits hold a duty of 1.
uint32_t fraction_bits_of(uint32_t pwm_bits) { return 30U - pwm_bits; }

// The ceiling of every duty; the timer's own is a step below a duty of 1.
uint32_t max_duty_steps(const SynthesisSettings& settings) {
  const uint32_t most_q15 = settings.limits.max_duty_q15;
  return ((most_q15 << settings.pwm_bits) >> 15) - (most_q15 == 32768U ? 1U : 0U);
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

uint32_t phase_step_u32(uint32_t frequency_millihertz, uint32_t pwm_bits) {
  // f / (80 MHz / 2^bits / 4) = f_mHz * 2^(bits - 11) / 9765625; as 2^32 times that, by long
  // division, because the product needs 64 bits.
  uint32_t remainder = frequency_millihertz;
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
  if (settings.frequency_millihertz < f::kMinFrequencyMillihertz) return false;
  if (settings.frequency_millihertz > f::kMaxFrequencyMillihertz) return false;
  if (settings.ramp_us > f::kMaxRampUs) return false;
  if (settings.touch_timeout_us > f::kMaxTouchTimeoutUs) return false;
  if (settings.max_on_us > f::kMaxOnUs) return false;
  if (settings.limits.max_duty_q15 > 32768U) return false;
  settings_ = settings;
  next_phase_step_u32_ = phase_step_u32(settings.frequency_millihertz, settings.pwm_bits);
  const uint32_t fraction_bits = fraction_bits_of(settings.pwm_bits);
  player_.start({
      settings.channels,
      {fraction_bits, (1 << fraction_bits) - 1, static_cast<int32_t>(max_duty_steps(settings))},
      ramp_rate(settings.ramp_us),
      samples_in(settings.touch_timeout_us, settings.pwm_bits),
      samples_in(settings.max_on_us, settings.pwm_bits),
      samples_in(kMostLateUs, settings.pwm_bits),
  });
  stream().start(settings.channels);
  return true;
}

RampRate Synthesis::ramp_rate(uint32_t ramp_us) const {
  uint32_t samples = samples_in(ramp_us, settings_.pwm_bits);
  if (samples < kShortestRamp) samples = kShortestRamp;
  RampRate rate;
  rate.samples = static_cast<int32_t>(samples);
  // 65536 / samples as a factor of 15 bits and a shift; of ramps beyond 131,072 samples, which
  // only decays have, the factor has 14.
  while (rate.shift < 15U && (65536U << rate.shift) / samples < (1U << 14)) ++rate.shift;
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
  const uint32_t max_duty = max_duty_steps(settings_);
  const uint32_t taken = rest + kBiasMarginSteps;
  const uint32_t peak_room = max_duty > taken ? (max_duty - taken) / 2U : 0U;
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
  if (has_command()) return false;
  Command command{};
  command.kind = Kind::kDrive;
  command.starts_touch = options.starts_touch;
  command.rate = ramp_rate(options.ramp_us);
  command.phase_step_u32 = next_phase_step_u32_;
  command.edges = EdgeScale::of(next_phase_step_u32_);
  command.waveform = options.starts_touch ? next_waveform_ : handover().command.waveform;
  std::array<uint32_t, kMaxChannels> sizes{};
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    const int32_t in_phase = drive[k].in_phase_q15, quadrature = drive[k].quadrature_q15;
    sizes[k] = square_root(static_cast<uint32_t>(in_phase * in_phase) +
                           static_cast<uint32_t>(quadrature * quadrature));
  }
  start_load_ramp(options.ramp_us);
  const auto level = static_cast<int32_t>(
      fitting_level(sizes, options.level_q15 > 32767U ? 32767U : options.level_q15));
  // Gains times this are duty steps with the shaper's fraction.
  const auto half_span = static_cast<int32_t>(half_span_steps(settings_.pwm_bits));
  const uint32_t fraction_bits = fraction_bits_of(settings_.pwm_bits);
  const uint32_t shift = fraction_bits - 15U;
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
      command.bias[k] = (size + 1) * half_span * (1 << shift) + rest * (1 << fraction_bits);
    }
    loads_[k] = load_of(command, k, static_cast<uint32_t>(size));
  }
  return post(command);
}

bool Synthesis::set_frequency(uint32_t frequency_millihertz) {
  namespace f = table_format;
  if (frequency_millihertz < f::kMinFrequencyMillihertz ||
      frequency_millihertz > f::kMaxFrequencyMillihertz)
    return false;
  next_phase_step_u32_ = phase_step_u32(frequency_millihertz, settings_.pwm_bits);
  return true;
}

bool Synthesis::set_waveform(Waveform waveform) {
  if (static_cast<uint32_t>(waveform) >= kWaveforms) return false;
  next_waveform_ = waveform;
  return true;
}

bool Synthesis::play_stream() {
  if (has_command()) return false;
  Command command{};
  command.kind = Kind::kStream;
  command.starts_touch = true;
  command.rate = ramp_rate(settings_.ramp_us);
  return post(command);
}

bool Synthesis::release(uint32_t ramp_us) {
  if (has_command()) return false;
  Command command{};
  command.kind = Kind::kRelease;
  command.waveform = handover().command.waveform;
  command.rate = ramp_rate(ramp_us);
  return post(command);
}

Load Synthesis::load_of(const Command& command, uint32_t channel, uint32_t size_q15) const {
  // A bias has 30 bits, of which 14 are below the 16 wanted; so has half of a square of 15.
  const uint32_t mean_q16 = static_cast<uint32_t>(command.bias[channel]) >> 14;
  const uint32_t half_span = half_span_steps(settings_.pwm_bits);
  const uint32_t amplitude_q16 = (size_q15 * half_span >> settings_.pwm_bits) * 2U;
  const uint32_t square_q16 = (amplitude_q16 >> 1) * (amplitude_q16 >> 1) >> 14;
  // Mean squares of the waves: a sine's is a half.
  uint32_t share = 2;
  if (command.waveform == Waveform::kTriangle || command.waveform == Waveform::kRamp) share = 3;
  if (command.waveform == Waveform::kSquare) share = 1;
  return {mean_q16, ((mean_q16 >> 1) * (mean_q16 >> 1) >> 14) + square_q16 / share};
}

Load Synthesis::load_now(uint32_t channel) const {
  if (output() == Output::kOff) return {0, 0};
  const Load& own = loads_[channel];
  return ramp_ms_left_ > 0 ? larger(own, older_loads_[channel]) : own;
}

// While a drive goes over into the next, coils get no more than the larger of the two.
void Synthesis::start_load_ramp(uint32_t ramp_us) {
  for (uint32_t k = 0; k < settings_.channels; ++k) older_loads_[k] = load_now(k);
  ramp_ms_left_ = ramp_us / 1000U + 2U;
}

bool Synthesis::post(const Command& command) {
  handover().command = command;
  // What ended the last touch must not be taken for the end of this one.
  if (command.starts_touch)
    handover().fade_cause.store(FadeCause::kNone, std::memory_order_relaxed);
  handover().command_waits.store(1, std::memory_order_release);
  announce();
  return true;
}

// One writer, so a plain load and store count correctly without a read-modify-write.
void Synthesis::keep_alive() {
  const uint32_t beats = handover().beats.load(std::memory_order_relaxed) + 1U;
  handover().beats.store(beats, std::memory_order_relaxed);
  announce();
}

void Synthesis::announce() {
  const uint32_t news = handover().news.load(std::memory_order_relaxed) + 1U;
  handover().news.store(news, std::memory_order_release);
}

void Synthesis::take_loads(Loads& loads, uint32_t passed_ms) {
  for (uint32_t k = 0; k < settings_.channels; ++k) loads[k] = load_now(k);
  const bool is_stream = handover().command.kind == Kind::kStream;
  if (is_stream && output() != Output::kOff) stream().loads(loads);
  ramp_ms_left_ -= passed_ms < ramp_ms_left_ ? passed_ms : ramp_ms_left_;
}

}  // namespace chladni
