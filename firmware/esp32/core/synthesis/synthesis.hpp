// The main loop's half of the synthesis: a drive becomes a command in duties, within the limits.
// The sample interrupt's half plays it (sample_player.hpp): up to sixteen PWM waves of one
// frequency, 20 to 1000 Hz, from one 32-bit phase, or a host's stream of duties instead
// (duty_ring.hpp).
//
// A switch drives current one way only, so a bias rides under every wave, as large as its amplitude
// needs and ramped with it. A bridge drives it both ways: its duties have a sign and no bias.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/synthesis/drive.hpp"
#include "core/synthesis/handover.hpp"
#include "core/synthesis/sample_player.hpp"

namespace chladni {

constexpr uint32_t kCarrierPeriodsPerSample = 4;

struct SynthesisSettings {
  uint32_t channels;              // 1 to kMaxChannels
  uint32_t pwm_bits;              // 10 to 12; the carrier is 80 MHz / 2^bits
  uint32_t frequency_millihertz;  // of the wave, millihertz
  uint32_t ramp_us;               // a stream fades in and anything fades out in this time
  uint32_t touch_timeout_us;      // outputs fade out when "still touched" is not said for this long
  uint32_t max_on_us;             // and after this in any case
  bool has_bridges;               // coils are driven both ways, without a bias
  uint32_t lost_steps;            // of a bridge's pulse
  std::array<uint8_t, kMaxChannels> sign_pins;
  OutputLimits limits;
};

// How a drive is played.
struct PlayOptions {
  uint32_t level_q15;  // loudness, 0 to 32767
  uint32_t ramp_us;    // time to get there
  bool starts_touch;   // starts the on-time again; else a move within a touch, void once that ended
  // Switches' biases begin and end slowly. For what waits for them: no wave may need them sooner.
  bool is_smooth = false;
};

// Largest amplitude in duty steps. Two steps above and below are the shaper's own.
constexpr uint32_t half_span_steps(uint32_t pwm_bits) { return (1U << (pwm_bits - 1)) - 3U; }
constexpr uint32_t kBiasMarginSteps = 2;
// Duties are set in the middle of a carrier period or later; a pulse so long has ended by then.
constexpr uint32_t most_turned_steps(uint32_t pwm_bits) { return 3U << (pwm_bits - 3); }
// The same of a bridge, which has the whole range.
constexpr uint32_t full_span_steps(uint32_t pwm_bits, uint32_t lost_steps) {
  return (1U << pwm_bits) - 3U - lost_steps;
}
// What a bridge loses of a pulse, rounded; a step is 12.5 ns.
constexpr uint32_t lost_steps(uint32_t lost_ns) { return (lost_ns * 2U + 12U) / 25U; }

// A finger's signal among others: a sine, or what is pushed for it, of which the drive's in-phase
// gains are played.
struct Voice {
  Drive drive{};
  uint32_t level_q15 = 0;  // loudness, 0 (silent) to 32767
  // It begins, with this frequency; one that goes on keeps its own.
  bool starts = false;
  uint32_t frequency_millihertz = 0;
  bool has_signal = false;
};
using Voices = std::array<Voice, kMaxVoices>;

// Sample rate 80 MHz / 2^bits / 4; `frequency_millihertz` must be below half of it.
uint32_t phase_step_u32(uint32_t frequency_millihertz, uint32_t pwm_bits);
uint32_t samples_in(uint32_t microseconds, uint32_t pwm_bits);
// A period over the supply's window, 12 bits, rounded up; of 1 Hz at least.
constexpr uint32_t period_share_q12(uint32_t frequency_millihertz) {
  return (4096U * 1000000U / kSupplyWindowMs) / frequency_millihertz + 1U;
}
// Of what is rounded to duty steps: 30 bits stand for a duty of 1.
constexpr uint32_t fraction_bits_of(uint32_t pwm_bits) { return 30U - pwm_bits; }

const char* to_text(FadeCause cause);

// A coil stands under the last duty while samples are missing; it may for so long.
constexpr uint32_t kMostLateUs = 500;

class Synthesis {
 public:
  // Outputs are off until the first drive. False if a setting is out of range.
  bool start(const Hal& hal, const SynthesisSettings& settings);

  // Go to a drive. A level that a limit does not allow is lowered for all channels alike.
  // False while the last command waits to be taken.
  bool play(const Drive& drive, const PlayOptions& options);
  // The same of one channel alone, with a sine of a frequency of its own, by which this touch is.
  bool play_alone(uint32_t channel, int16_t gain_q15, uint32_t frequency_millihertz,
                  uint32_t step_u32, uint32_t ramp_us);
  // Of what was last asked for, 65536 for a duty of 1: limits may have lowered it.
  uint32_t amplitude_q16(uint32_t channel) const {
    return static_cast<uint32_t>(handover().command.first[channel]) >> 14;
  }
  // The same for several fingers, each in a place of its own for as long as it plays. Limits are
  // kept for the sum, whatever the voices' phases come to, by lowering all of them alike. The level
  // of the options is not read. If the touch's wave is no sine, only the first voice that is not
  // silent plays.
  bool play_voices(const Voices& voices, const PlayOptions& options);
  // Waves of the touches that start from now on; false if out of range.
  bool set_frequency(uint32_t frequency_millihertz);
  bool set_waveform(Waveform waveform);
  // Play the stream instead; false as for `play`.
  bool play_stream();
  // Fade out.
  bool release(uint32_t ramp_us);
  // Whatever plays or waits.
  void stop(Stop stop = Stop::kFade);
  // The finger, or the host, is still there.
  void keep_alive();

  // For the sample interrupt, which calls nothing else of this class. Inlined, since a copy of its
  // own would lie in flash.
  [[gnu::always_inline]] SamplePlayer& player() { return player_; }

  Output output() const { return handover().output.load(std::memory_order_acquire); }
  // Off, and nothing is waiting to change that.
  bool is_quiet() const { return !has_command() && output() == Output::kOff; }
  FadeCause fade_cause() const { return handover().fade_cause.load(std::memory_order_acquire); }
  // Samples since start, those that were missed included: it stands still if the interrupt does.
  uint32_t samples() const { return handover().samples.load(std::memory_order_relaxed); }
  // Before the first of them.
  void count_from(uint32_t samples) {
    player_.count_from(samples);
    seen_samples_ = samples;
  }
  // The sample with which the last touch began from silence, by the same count; phases begin with
  // it.
  uint32_t begun() const { return handover().begun.load(std::memory_order_relaxed); }
  // Samples that were missed since start.
  uint32_t missed() const { return handover().missed.load(std::memory_order_relaxed); }
  // Drives whose level a limit lowered.
  uint32_t limited() const { return limited_; }
  // What the pins got since the last call, as the interrupt metered it. Where no sample came in
  // these milliseconds, what the duties make that still stand there. Whether one came.
  bool take_squares(Squares& squares, uint32_t milliseconds);
  // What a stream would hold with one more frame: how long it would last, ms, and what the supply
  // would deliver to it, mA times ms.
  uint32_t stream_ms() const { return ((stream().ahead() + 1U) << settings_.pwm_bits) / 10000U; }
  uint32_t stream_charge(uint32_t last_ma) const;
  DutyRing& stream() { return handover().stream; }
  SignalRing& signal(uint32_t voice) { return handover().signals[voice]; }
  const DutyRing& stream() const { return handover().stream; }

 private:
  Handover& handover() { return player_.handover(); }
  const Handover& handover() const { return player_.handover(); }
  bool has_command() const {
    return handover().command_waits.load(std::memory_order_acquire) != 0 ||
           handover().must_stop.load(std::memory_order_acquire) != Stop::kNo;
  }
  RampRate ramp_rate(uint32_t ramp_us) const;
  using Sizes = std::array<uint32_t, kMaxChannels>;
  using Levels = std::array<uint32_t, kMaxVoices>;
  static uint32_t size_of(Gain gain) {
    const int32_t in_phase = gain.in_phase_q15, quadrature = gain.quadrature_q15;
    return square_root(static_cast<uint32_t>(in_phase * in_phase) +
                       static_cast<uint32_t>(quadrature * quadrature));
  }
  Sizes sizes_of(const Voices& voices, const Levels& levels_q15) const;
  uint32_t fit_voices(const Voices& voices, Levels& levels_q15, Sizes& sizes);
  void begin_voices(const Voices& voices, Command& command);
  void set_gains(const Drive& drive, int32_t level_q15, int32_t* in_phase,
                 int32_t* quadrature) const;
  // Voices that a command lets sound, a bit each.
  void let_sound(uint32_t voices);
  uint32_t max_duty_steps() const;
  int32_t gain_scale() const;
  int32_t bias_of(int32_t size_q15) const;
  uint32_t fitting_level(const Sizes& sizes, uint32_t level_q15, Waveform waveform);
  // Of a drive's gain of 1, in duty steps.
  uint32_t span_steps() const {
    return settings_.has_bridges ? full_span_steps(settings_.pwm_bits, settings_.lost_steps)
                                 : half_span_steps(settings_.pwm_bits);
  }
  uint32_t amplitude_steps(uint32_t size_q15, uint32_t level_q15) const;
  uint32_t delivered_ma(const Sizes& sizes, uint32_t level_q15, Waveform waveform) const;
  Command& next_command(Command::Kind kind, bool starts_touch, uint32_t ramp_us);
  void post();
  void announce();

  SamplePlayer player_{};
  SynthesisSettings settings_{};
  uint32_t next_phase_step_u32_ = 0;
  Waveform next_waveform_ = Waveform::kSine;
  // Periods over the supply's window, 12 bits: of the touches to come, of the voices as they began,
  // and the longest of those that sound.
  uint32_t next_period_q12_ = 0;
  std::array<uint32_t, kMaxVoices> periods_q12_{};
  uint32_t period_q12_ = 0;
  uint32_t limited_ = 0;
  // What was read of the interrupt's meter.
  std::array<uint32_t, kMaxChannels> seen_squares_{};
  uint32_t seen_samples_ = 0;
};

}  // namespace chladni
