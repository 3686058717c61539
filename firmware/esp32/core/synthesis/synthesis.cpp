#include "core/synthesis/synthesis.hpp"

#include "core/generated/table_format.hpp"
#include "core/synthesis/waves/sine.hpp"

namespace chladni {

namespace {

using Kind = Command::Kind;

// Half of the meter's range: no sum of one turn is larger.
constexpr uint32_t kMostSquares = 0x80000000U;
// A ramp of fewer samples would need a factor beyond 15 bits.
constexpr uint32_t kShortestRamp = 4;

// The largest mean square of the duty over the supply's window, 15 bits, of a wave of this
// amplitude upon this bias. The window may take in the crest of one period more than its trough:
// half a period's area of the wave, and of its square about that square's mean. It may do so twice,
// at the end of one touch and at the beginning of the next.
uint32_t largest_square_q15(Waveform waveform, uint32_t amplitude_q15, uint32_t bias_q15,
                            uint32_t period_q12) {
  struct Form {
    uint32_t square_q8, area_q8, square_area_q8;  // of a wave and of a period of 1, rounded up
  };
  constexpr Form kSine{128, 82, 21}, kSquare{256, 128, 0}, kTriangle{86, 64, 33};
  const bool is_sine = waveform == Waveform::kSine, is_square = waveform == Waveform::kSquare;
  const Form form = is_sine ? kSine : (is_square ? kSquare : kTriangle);
  const uint32_t own = amplitude_q15 * amplitude_q15 >> 15;
  const uint32_t both = bias_q15 * amplitude_q15 >> 15;
  const uint32_t mean = (bias_q15 * bias_q15 >> 15) + (own * form.square_q8 >> 8) + 2U;
  const uint32_t area = (2U * both * form.area_q8 + own * form.square_area_q8) >> 8;
  const uint32_t crest = bias_q15 + amplitude_q15;
  const uint32_t most = (crest * crest >> 15) + 1U, swing = (area + 1U) * period_q12 >> 11;
  return mean + swing < most ? mean + swing : most;
}

// 64 ms of periods; `frequency_millihertz` is 1 Hz at least.
uint32_t period_share_q12(uint32_t frequency_millihertz) {
  return (4096U * 1000000U / kSupplyWindowMs) / frequency_millihertz + 1U;
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
  // A bridge loses less than a twentieth of a carrier period.
  if (settings.lost_steps > 1U << (settings.pwm_bits - 4U)) return false;
  settings_ = settings;
  if (!settings.has_bridges) settings_.lost_steps = 0;
  if (settings.has_bridges) settings_.limits.min_on_steps = 0;
  const auto max_duty = static_cast<int32_t>(max_duty_steps(settings));
  set_frequency(settings.frequency_millihertz);
  const uint32_t fraction_bits = fraction_bits_of(settings.pwm_bits);
  player_.start({
      settings.channels,
      {fraction_bits, (1 << fraction_bits) - 1, max_duty},
      settings.has_bridges,
      {static_cast<int32_t>(settings_.lost_steps), max_duty, -max_duty,
       -static_cast<int32_t>(most_turned_steps(settings.pwm_bits))},
      ramp_rate(settings.ramp_us),
      samples_in(settings.touch_timeout_us, settings.pwm_bits),
      samples_in(settings.max_on_us, settings.pwm_bits),
      samples_in(kMostLateUs, settings.pwm_bits),
  });
  stream().start(settings.channels, settings_.limits.full_current_ma.data(), settings.has_bridges);
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

uint32_t Synthesis::amplitude_steps(uint32_t size_q15, uint32_t level_q15) const {
  const uint32_t share = (size_q15 * level_q15) >> 15, full = kOneQ15;
  return ((share < full ? share : full) * span_steps() >> 15) + 1U;
}

uint32_t Synthesis::delivered_ma(const Sizes& sizes, uint32_t level_q15, Waveform waveform) const {
  const uint32_t to_q15 = 15U - settings_.pwm_bits;
  const uint32_t rest = kBiasMarginSteps + settings_.limits.min_on_steps;
  uint32_t sum = 0;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    if (sizes[k] == 0) continue;
    const uint32_t steps = amplitude_steps(sizes[k], level_q15) + settings_.lost_steps;
    const uint32_t bias = settings_.has_bridges ? 0U : steps + rest;
    const uint32_t square_q15 =
        largest_square_q15(waveform, steps << to_q15, bias << to_q15, period_q12_);
    sum += square_q15 * settings_.limits.full_current_ma[k];
  }
  return (sum >> 15) + 1U;
}

uint32_t Synthesis::fitting_level(const Sizes& sizes, uint32_t level_q15, Waveform waveform) {
  const OutputLimits& limits = settings_.limits;
  uint32_t largest = 0;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    const uint32_t steps = amplitude_steps(sizes[k], level_q15);
    if (steps > largest) largest = steps;
  }
  uint32_t level = level_q15;
  const uint32_t max_duty = max_duty_steps(settings_);
  // Rounding needs room above a wave, and below a switch's.
  const bool has_bridges = settings_.has_bridges;
  const uint32_t taken = has_bridges ? kBiasMarginSteps + settings_.lost_steps
                                     : 2U * kBiasMarginSteps + limits.min_on_steps;
  const uint32_t swing = max_duty > taken ? max_duty - taken : 0U;
  const uint32_t peak_room = has_bridges ? swing : swing / 2U;
  if (largest > peak_room) level = share_of(level_q15, peak_room, largest);
  const uint32_t most_ma = reckoned_limit(limits.supply_ma);
  if (limits.supply_ma > 0 && delivered_ma(sizes, level, waveform) > most_ma) {
    // Bit by bit: the largest level that the supply allows.
    uint32_t fitting = 0;
    for (uint32_t bit = 1U << 14; bit != 0; bit >>= 1) {
      const uint32_t trial = fitting | bit;
      if (trial > level || delivered_ma(sizes, trial, waveform) > most_ma) continue;
      fitting = trial;
    }
    level = fitting;
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
  if (options.starts_touch) period_q12_ = next_period_q12_;
  Sizes sizes{};
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    const int32_t in_phase = drive[k].in_phase_q15, quadrature = drive[k].quadrature_q15;
    sizes[k] = square_root(static_cast<uint32_t>(in_phase * in_phase) +
                           static_cast<uint32_t>(quadrature * quadrature));
  }
  const uint32_t asked = options.level_q15 > 32767U ? 32767U : options.level_q15;
  const auto level = static_cast<int32_t>(fitting_level(sizes, asked, command.waveform));
  // Gains times this are duty steps with the shaper's fraction.
  const auto span = static_cast<int32_t>(span_steps());
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
      command.first[k] = in_phase * span * (1 << shift);
      command.second[k] = quadrature * span * (1 << shift);
    } else {
      command.first[k] = size * span * (1 << shift);
      command.second[k] = static_cast<int32_t>(phase_of(in_phase, quadrature));
    }
    // A silent channel needs no bias; any other needs its amplitude, rounded up, and the rest.
    if (sizes[k] > 0 && level > 0 && !settings_.has_bridges) {
      command.bias[k] = (size + 1) * span * (1 << shift) + rest * (1 << fraction_bits);
    }
  }
  return post(command);
}

bool Synthesis::set_frequency(uint32_t frequency_millihertz) {
  namespace f = table_format;
  if (frequency_millihertz < f::kMinFrequencyMillihertz ||
      frequency_millihertz > f::kMaxFrequencyMillihertz)
    return false;
  next_phase_step_u32_ = phase_step_u32(frequency_millihertz, settings_.pwm_bits);
  next_period_q12_ = period_share_q12(frequency_millihertz);
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

void Synthesis::stop(Stop stop) {
  // What is to end at once does so, whoever asks for less.
  if (handover().must_stop.load(std::memory_order_relaxed) >= stop) return;
  handover().must_stop.store(stop, std::memory_order_release);
  announce();
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

// A frame lasts 2^bits/10,000 ms. If it is the last, its duties are held and fade: a third of the
// ramp, by their squares.
uint32_t Synthesis::stream_charge(const uint16_t* duties_q16) {
  const uint32_t last_ma = stream().frame_ma(duties_q16);
  const uint32_t frames = stream().ahead_ma() + last_ma, scale = 1U << (settings_.pwm_bits - 4U);
  const uint32_t held = frames / 625U * scale + frames % 625U * scale / 625U + 1U;
  return held + last_ma * (settings_.ramp_us / 3000U + 1U);
}

bool Synthesis::take_squares(Squares& squares, uint32_t milliseconds) {
  stream().forget_played();
  const uint32_t now = samples(), passed = now - seen_samples_;
  seen_samples_ = now;
  const bool has_come = passed != 0;
  const uint32_t held_for = has_come ? 0U : samples_in(1000U * milliseconds, settings_.pwm_bits);
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    uint32_t more = player_.square_sum(k) - seen_squares_[k];
    // What was reckoned while none came is metered when the next one comes.
    if (more > kMostSquares) more = 0;
    more += player_.square(k) * held_for;
    seen_squares_[k] += more;
    // What the shift has cut off each time, at most.
    if (more > 0) more += passed;
    // A sample lasts 2^bits/20,000 ms: of 10 bits 512/625 of a sum, of more bits less.
    squares[k] = (more / 625U * 512U + more % 625U * 512U / 625U) >> (settings_.pwm_bits - 10U);
  }
  return has_come;
}

}  // namespace chladni
