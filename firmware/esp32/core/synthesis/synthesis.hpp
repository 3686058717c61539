// Up to sixteen PWM waves of one frequency, 20 to 1000 Hz, from one 32-bit phase, a sample per
// call.
//
// A sine's channel has an in-phase and a quadrature gain, so a new drive is reached by a straight
// ramp of those two: gain and phase change together and nothing clicks. Other waves have an
// amplitude and a phase per channel, which go straight to the next drive's, the phase by the
// shorter way round. The outputs switch current one way only, so a bias rides under every wave, as
// large as its amplitude needs and ramped with it. Duties are rounded with the error of the last
// two samples fed back, which moves the rounding noise above the band a finger feels.
//
// Instead of waves, a host's stream of duties can be played (stream.hpp).
//
// `sample` belongs to the sample interrupt; every other member to the main loop.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/hal.hpp"
#include "core/synthesis/duty_ring.hpp"
#include "core/synthesis/output_limits.hpp"
#include "core/synthesis/sine.hpp"
#include "core/synthesis/waveform.hpp"

namespace chladni {

constexpr uint32_t kCarrierPeriodsPerSample = 4;

// In-phase and quadrature gain of one channel: a sine is I cos(wt) - Q sin(wt).
struct Gain {
  int16_t in_phase_q15;
  int16_t quadrature_q15;
};

using Drive = std::array<Gain, kMaxChannels>;

struct SynthesisSettings {
  uint32_t channels;              // 1 to kMaxChannels
  uint32_t pwm_bits;              // 10 to 12; the carrier is 80 MHz / 2^bits
  uint32_t frequency_millihertz;  // of the wave, millihertz
  uint32_t ramp_us;               // a stream fades in and anything fades out in this time
  uint32_t touch_timeout_us;      // outputs fade out when "still touched" is not said for this long
  uint32_t max_on_us;             // and after this in any case
  OutputLimits limits;
};

// How a drive is played.
struct PlayOptions {
  uint32_t level_q15;  // loudness, 0 to 32767
  uint32_t ramp_us;    // time to get there
  bool starts_touch;   // starts the on-time again; else a move within a touch, void once that ended
};

// Largest amplitude in duty steps. Two steps above and below are the shaper's own.
constexpr uint32_t half_span_steps(uint32_t pwm_bits) { return (1U << (pwm_bits - 1)) - 3U; }
constexpr uint32_t kBiasMarginSteps = 2;

// Sample rate 80 MHz / 2^bits / 4; `frequency_millihertz` must be below half of it.
uint32_t phase_step_u32(uint32_t frequency_millihertz, uint32_t pwm_bits);
uint32_t samples_in(uint32_t microseconds, uint32_t pwm_bits);

enum class Output : uint8_t {
  kOff,      // duty 0 on every channel
  kPlaying,  // a drive or a stream, or on the way to one
  kFading,   // on the way to off
};

enum class FadeCause : uint8_t {
  kNone,
  kReleased,      // the main loop asked for it
  kTouchTimeout,  // no sign of the touch for touch_timeout_us
  kMaxOn,         // on for max_on_us
  kLate,          // the sample interrupt came later than kMostLateUs
  kUnderrun,      // the stream has run dry
};

const char* to_text(FadeCause cause);

// A coil stands under the last duty while samples are missing; it may for so long.
constexpr uint32_t kMostLateUs = 1000;

// What a channel's coil gets: means of its duty and of its square, 65536 for a duty of 1.
struct Load {
  uint32_t mean_q16;
  uint32_t square_q16;
};
using Loads = std::array<Load, kMaxChannels>;

class Synthesis {
 public:
  // Outputs are off until the first drive. False if a setting is out of range.
  bool start(const SynthesisSettings& settings);

  // Go to a drive. A level that a limit does not allow is lowered for all channels alike.
  // False while the last command waits to be taken.
  bool play(const Drive& drive, const PlayOptions& options);
  // Waves of the touches that start from now on; false if out of range.
  bool set_frequency(uint32_t frequency_millihertz);
  bool set_waveform(Waveform waveform);
  // Play the stream instead; false as for `play`.
  bool play_stream();
  // Fade out.
  bool release(uint32_t ramp_us);
  // The finger, or the host, is still there.
  void keep_alive();

  // Advance by one sample and set every channel's duty. Interrupt only. `missed` samples before
  // this one were never asked for.
  void sample(const Hal& hal, uint32_t missed);

  Output output() const { return output_.load(std::memory_order_acquire); }
  // Off, and nothing is waiting to change that.
  bool is_quiet() const {
    return command_waits_.load(std::memory_order_acquire) == 0 && output() == Output::kOff;
  }
  FadeCause fade_cause() const { return fade_cause_.load(std::memory_order_acquire); }
  // Samples since start, those that were missed included: it stands still if the interrupt does.
  uint32_t samples() const { return samples_.load(std::memory_order_relaxed); }
  // Samples that were missed since start.
  uint32_t missed() const { return missed_.load(std::memory_order_relaxed); }
  // Drives whose level a limit lowered.
  uint32_t limited() const { return limited_; }
  // Of what plays, over the milliseconds since the last call: of the drive that was posted last, or
  // the larger of two while one goes over into the other; of a stream, its recent mean.
  void take_loads(Loads& loads, uint32_t passed_ms);
  DutyRing& stream() { return stream_; }
  const DutyRing& stream() const { return stream_; }

 private:
  enum class Kind : uint8_t { kDrive, kStream, kRelease };

  // How far a ramp goes per sample, without a division: (way >> 16) * factor >> shift.
  struct RampRate {
    int32_t samples = 1;
    int32_t factor = 0;
    uint32_t shift = 0;
  };

  struct Command {
    Kind kind;
    bool starts_touch;
    Waveform waveform;
    RampRate rate;
    uint32_t phase_step_u32;  // taken by a drive that starts a touch
    EdgeScale edges;
    // Sine: the two gains. Others: amplitude, and phase as an unsigned number.
    std::array<int32_t, kMaxChannels> first;
    std::array<int32_t, kMaxChannels> second;
    std::array<int32_t, kMaxChannels> bias;
  };

  // Gains and amplitudes are in duty steps times 2^(fraction_bits - 15), so that the wave in Q15
  // makes them what the bias is in: duty steps times 2^fraction_bits. `..._step` times the samples
  // that are left of a ramp is what is missing from where it leads to; gains and amplitudes have 15
  // bits more there. So a ramp ends exactly, and its end costs nothing.
  struct Channel {
    int32_t first;   // sine: in-phase gain; others: amplitude
    int32_t second;  // sine: quadrature gain; others: phase of 32 bits
    int32_t bias;
    // Of the last sample's rounding and the one before: from 0 to a whole step.
    int32_t error;
    int32_t older_error;
    int32_t first_step;
    int32_t second_step;
    int32_t bias_step;
  };

  // What a sample does.
  // A fade of sines is apart, so that what plays need not look whether it ends.
  enum class Mode : uint8_t {
    kSines,
    kFadingSines,
    kOthers,
    kStream,
    kOff,
  };

  // Rounds down to whole steps and feeds the error of the last two samples back: the duty is what
  // was wanted less the second difference of the error, and any constant part of it cancels.
  struct Shaper {
    uint32_t fraction_bits;
    int32_t mask;
    int32_t max_duty;

    [[gnu::always_inline]] uint32_t shape(Channel& channel, int32_t wanted) const {
      const int32_t fed = wanted + 2 * channel.error - channel.older_error;
      const int32_t duty = fed >> fraction_bits;
      channel.older_error = channel.error;
      channel.error = fed & mask;
      // What is cut off is not fed back: it could only grow.
      if (static_cast<uint32_t>(duty) > static_cast<uint32_t>(max_duty)) {
        return duty < 0 ? 0U : static_cast<uint32_t>(max_duty);
      }
      return static_cast<uint32_t>(duty);
    }
  };

  RampRate ramp_rate(uint32_t ramp_us) const;
  uint32_t fitting_level(const std::array<uint32_t, kMaxChannels>& sizes, uint32_t level_q15);
  void start_load_ramp(uint32_t ramp_us);
  Load load_now(uint32_t channel) const;
  void announce();
  Load load_of(const Command& command, uint32_t channel, uint32_t size_q15) const;
  bool post(const Command& command);
  void consider_command();
  bool can_take(const Command& command) const;
  void take(const Command& command);
  void fade(FadeCause cause, RampRate rate);
  void go_off();
  // A ramp's step from one value to another.
  int32_t step(int32_t from, int32_t to) const;
  void aim(Channel& channel, int32_t first, int32_t second, int32_t bias);
  void catch_up(uint32_t missed);
  uint32_t advance(uint32_t count) {
    const uint32_t samples = samples_.load(std::memory_order_relaxed) + count;
    samples_.store(samples, std::memory_order_relaxed);
    return samples;
  }
  void still_silent_channels();
  void miss_deadline();
  void forget_deadlines();

  // The sample interrupt in pieces that end in one another: what every sample goes through calls
  // nothing, so that few registers need be saved.
  [[gnu::noinline]] void sample_with_news(const Hal& hal, uint32_t missed);
  [[gnu::noinline]] void sample_at_deadline(const Hal& hal);
  [[gnu::noinline]] void other_sample(const Hal& hal);
  bool plays_sines() const { return mode_ <= Mode::kFadingSines; }
  template <bool kIsRamping>
  [[gnu::always_inline]] inline void play_mode();
  [[gnu::always_inline]] inline void finish(const Hal& hal);
  template <bool kIsRamping>
  [[gnu::always_inline]] inline void sines();
  template <bool kIsRamping>
  [[gnu::always_inline]] inline void others();
  template <bool kIsRamping, typename Wave>
  [[gnu::always_inline]] inline void like(Wave wave_q15);
  void streamed();

  // How often the main loop had something for the interrupt; counted after what it announces.
  std::atomic<uint32_t> news_{0};

  // The interrupt's, what every sample needs first.
  uint32_t seen_news_ = 0;
  std::atomic<uint32_t> samples_{0};  // since start; written by the interrupt alone
  uint32_t quiet_end_ = 0;
  uint32_t on_end_ = 0;
  Mode mode_ = Mode::kOff;
  int32_t ramp_left_ = 0;  // samples
  uint32_t phase_u32_ = 0;
  uint32_t phase_step_u32_ = 0;
  Shaper shaper_{20, (1 << 20) - 1, 0};
  uint32_t last_channel_ = 0;
  std::array<uint32_t, kMaxChannels> duties_{};
  std::array<Channel, kMaxChannels> channels_{};
  // And what only some need.
  SynthesisSettings settings_{};
  int32_t stream_gain_q15_ = 0;  // where its ramp leads to
  int32_t stream_step_q30_ = 0;
  Waveform waveform_ = Waveform::kSine;
  EdgeScale edges_{};
  RampRate rate_{};
  RampRate fade_rate_{};
  uint32_t timeout_samples_ = 0;
  uint32_t max_on_samples_ = 0;
  uint32_t late_samples_ = 0;

  // Main loop to interrupt: one command at a time, signs of life, and the stream.
  Command command_{};
  std::atomic<uint32_t> command_waits_{0};
  std::atomic<uint32_t> beats_{0};
  uint32_t seen_beats_ = 0;  // by the interrupt
  uint32_t next_phase_step_u32_ = 0;
  Waveform next_waveform_ = Waveform::kSine;
  uint32_t limited_ = 0;
  Loads loads_{};        // of `command_`
  Loads older_loads_{};  // and of what it ramps from
  uint32_t ramp_ms_left_ = 0;
  // Interrupt to main loop.
  std::atomic<Output> output_{Output::kOff};
  std::atomic<FadeCause> fade_cause_{FadeCause::kNone};
  std::atomic<uint32_t> missed_{0};
  DutyRing stream_{};
};

}  // namespace chladni
