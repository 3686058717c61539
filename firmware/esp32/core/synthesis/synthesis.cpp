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

bool Synthesis::start(const Hal& hal, const SynthesisSettings& settings) {
  player_.connect(hal);
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
  const auto max_duty = static_cast<int32_t>(max_duty_steps());
  // Of a bridge, the duty of one step; 0 where a limit allows none.
  const auto lost = static_cast<int32_t>(settings_.lost_steps);
  const int32_t first = max_duty > lost ? lost + 1 : 0;
  set_frequency(settings.frequency_millihertz);
  const uint32_t fraction_bits = fraction_bits_of(settings.pwm_bits);
  player_.start({
      settings.channels,
      {fraction_bits, (1 << fraction_bits) - 1, max_duty},
      settings.has_bridges,
      {fraction_bits, -(1 << fraction_bits), first, first == 0 ? 0 : max_duty - first,
       static_cast<int32_t>(most_turned_steps(settings.pwm_bits))},
      settings.sign_pins,
      ramp_rate(settings.ramp_us),
      kSignalShift - settings.pwm_bits,
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

// Written where the interrupt finds it, which reads it only once it is posted. What is not written
// again, as the phase steps of voices that go on, stays.
Command& Synthesis::next_command(Kind kind, bool starts_touch, uint32_t ramp_us) {
  Command& command = handover().command;
  command.kind = kind;
  command.starts_touch = starts_touch;
  command.is_smooth = false;
  command.rate = ramp_rate(ramp_us);
  if (output() == Output::kOff) command.voices = 0;
  return command;
}

bool Synthesis::play(const Drive& drive, const PlayOptions& options) {
  if (has_command()) return false;
  Command& command = next_command(Kind::kDrive, options.starts_touch, options.ramp_us);
  if (options.starts_touch) {
    command.phase_step_u32 = next_phase_step_u32_;
    command.edges = EdgeScale::of(next_phase_step_u32_);
    command.waveform = next_waveform_;
    command.signals = 0;
    periods_q12_[0] = next_period_q12_;
  }
  let_sound(1U);
  Sizes sizes{};
  for (uint32_t k = 0; k < settings_.channels; ++k) sizes[k] = size_of(drive[k]);
  const uint32_t asked = options.level_q15 > 32767U ? 32767U : options.level_q15;
  const auto level = static_cast<int32_t>(fitting_level(sizes, asked, command.waveform));
  // Gains times this are duty steps with the shaper's fraction.
  const int32_t scale = gain_scale();
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
      command.first[k] = in_phase * scale;
      command.second[k] = quadrature * scale;
    } else {
      command.first[k] = size * scale;
      command.second[k] = static_cast<int32_t>(phase_of(in_phase, quadrature));
    }
    command.bias[k] = sizes[k] > 0 && level > 0 ? bias_of(size + 1) : 0;
  }
  post();
  return true;
}

bool Synthesis::play_alone(uint32_t channel, int16_t gain_q15, uint32_t frequency_millihertz,
                           uint32_t step_u32, uint32_t ramp_us) {
  if (has_command()) return false;
  next_phase_step_u32_ = step_u32;
  next_period_q12_ = period_share_q12(frequency_millihertz);
  next_waveform_ = Waveform::kSine;
  Drive drive{};
  drive[channel].in_phase_q15 = gain_q15;
  return play(drive, {32767, ramp_us, true});
}

// A silent channel needs no bias; any other needs its amplitude, rounded up, and the rest.
int32_t Synthesis::bias_of(int32_t size_q15) const {
  if (settings_.has_bridges) return 0;
  const uint32_t rest = kBiasMarginSteps + settings_.limits.min_on_steps;
  return size_q15 * gain_scale() +
         static_cast<int32_t>(rest << fraction_bits_of(settings_.pwm_bits));
}

int32_t Synthesis::gain_scale() const {
  return static_cast<int32_t>(span_steps() << (fraction_bits_of(settings_.pwm_bits) - 15U));
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
  Command& command = next_command(Kind::kStream, true, settings_.ramp_us);
  command.waveform = Waveform::kSine;
  post();
  return true;
}

bool Synthesis::release(uint32_t ramp_us) {
  if (has_command()) return false;
  next_command(Kind::kRelease, false, ramp_us);
  post();
  return true;
}

void Synthesis::stop(Stop stop) {
  // What is to end at once does so, whoever asks for less.
  if (handover().must_stop.load(std::memory_order_relaxed) >= stop) return;
  handover().must_stop.store(stop, std::memory_order_release);
  announce();
}

void Synthesis::post() {
  // What ended the last touch must not be taken for the end of this one.
  if (handover().command.starts_touch)
    handover().fade_cause.store(FadeCause::kNone, std::memory_order_relaxed);
  handover().command_waits.store(1, std::memory_order_release);
  announce();
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
uint32_t Synthesis::stream_charge(uint32_t last_ma) const {
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
