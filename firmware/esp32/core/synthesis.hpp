// Up to sixteen PWM waves of one frequency, 20 to 1000 Hz, from one 32-bit phase, a sample per call.
//
// A sine's channel has an in-phase and a quadrature gain, so a new drive is reached by a straight
// ramp of those two: gain and phase change together and nothing clicks. Other waves have an
// amplitude and a phase of their own per channel, and one drive is faded out while the next is
// faded in. The outputs switch current one way only, so a bias rides under every wave, as large as
// its amplitude needs and ramped with it. Duties are rounded with the error of the last two samples
// fed back, which moves the rounding noise above the band a finger feels.
//
// Instead of waves, a host's stream of duties can be played (stream.hpp).
//
// `sample` belongs to the sample interrupt; every other member to the main loop.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/hal.hpp"
#include "core/limits.hpp"
#include "core/stream.hpp"
#include "core/waveform.hpp"

namespace chladni {

constexpr uint32_t kCarrierPeriodsPerSample = 4;

// In-phase and quadrature gain of one channel: a sine is I cos(wt) - Q sin(wt).
struct Gain {
  int16_t in_phase_q15;
  int16_t quadrature_q15;
};

using Drive = std::array<Gain, kMaxChannels>;

struct SynthesisSettings {
  uint32_t channels;          // 1 to kMaxChannels
  uint32_t pwm_bits;          // 10 to 12; the carrier is 80 MHz / 2^bits
  uint32_t frequency_mhz;     // of the wave, millihertz
  uint32_t ramp_us;           // a stream fades in and anything fades out in this time
  uint32_t touch_timeout_us;  // outputs fade out when nobody says "still touched" for this long
  uint32_t max_on_us;         // and after this in any case
  OutputLimits limits;
};

// How a drive is played.
struct PlayOptions {
  uint32_t level_q15;  // loudness, 0 to 32767
  uint32_t ramp_us;    // time to get there
  bool starts_touch;   // starts the on-time anew; else a move within a touch, void once that ended
};

// Largest amplitude in duty steps. Two steps above and below are the shaper's own.
constexpr uint32_t half_span_steps(uint32_t pwm_bits) { return (1U << (pwm_bits - 1)) - 3U; }
constexpr uint32_t kBiasMarginSteps = 2;

// Sample rate 80 MHz / 2^bits / 4; `frequency_mhz` must be below half of it.
uint32_t phase_step_u32(uint32_t frequency_mhz, uint32_t pwm_bits);
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

// What was on the pins since start, taken from one channel per sample in turn. All counters wrap
// around: take differences.
struct Meter {
  uint32_t samples = 0;
  std::array<uint32_t, kMaxChannels> duty_q16{};    // sums of duties, 65536 for 1
  std::array<uint32_t, kMaxChannels> square_q16{};  // sums of their squares
};

class Synthesis {
 public:
  // Outputs are off until the first drive. False if a setting is out of range.
  bool start(const SynthesisSettings& settings);

  // Go to a drive. A level that a limit does not allow is lowered for all channels alike.
  // False while the last command waits to be taken.
  bool play(const Drive& drive, const PlayOptions& options);
  // Waves of the touches that start from now on; false if out of range.
  bool set_frequency(uint32_t frequency_mhz);
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
    return !command_waits_.load(std::memory_order_acquire) && output() == Output::kOff;
  }
  FadeCause fade_cause() const { return fade_cause_.load(std::memory_order_acquire); }
  // Samples that were missed since start.
  uint32_t missed() const { return missed_.load(std::memory_order_relaxed); }
  // Drives whose level a limit lowered.
  uint32_t limited() const { return limited_; }
  Meter meter() const;
  SampleStream& stream() { return stream_; }
  const SampleStream& stream() const { return stream_; }

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

  // A value that moves in equal steps and lands exactly.
  struct Ramp {
    int32_t value;
    int32_t step;
    int32_t end;
  };

  // Gains and amplitudes are in duty steps times 2^`fraction_bits_`, as the bias; the wave in Q15
  // makes the same of their upper 17 bits.
  struct Channel {
    Ramp first;   // sine: in-phase gain; others: amplitude of the drive being played
    Ramp second;  // sine: quadrature gain; others: amplitude of the drive before, fading out
    Ramp bias;
    uint32_t phase;        // of the drive being played; not for a sine
    uint32_t older_phase;  // of the drive before
    int32_t error;
    int32_t older_error;
  };

  using Duties = std::array<uint32_t, kMaxChannels>;

  RampRate ramp_rate(uint32_t ramp_us) const;
  uint32_t fitting_level(const std::array<uint32_t, kMaxChannels>& sizes, uint32_t level_q15);
  bool post(const Command& command);
  bool can_take(const Command& command) const;
  void take(const Command& command);
  void fade(FadeCause cause);
  void switch_off(const Hal& hal);
  void aim(Ramp& ramp, int32_t end) const;
  void land();
  void catch_up(uint32_t missed);
  void watch_deadlines();
  void measure(const Duties& duties);
  template <bool kIsRamping>
  void sines(Duties& duties);
  template <bool kIsRamping>
  void others(Duties& duties);
  void streamed(Duties& duties);
  int32_t wave_q15(uint32_t phase_u32) const;
  uint32_t shape(Channel& channel, int32_t wanted) const;
  uint32_t clip(Channel& channel, int32_t duty, int32_t error) const;

  SynthesisSettings settings_{};
  uint32_t phase_u32_ = 0;
  uint32_t phase_step_u32_ = 0;
  Waveform waveform_ = Waveform::kSine;
  EdgeScale edges_{};
  bool is_stream_ = false;
  uint32_t fraction_bits_ = 20;
  int32_t max_duty_ = 0;
  RampRate rate_{};
  RampRate fade_rate_{};
  int32_t ramp_left_ = 0;
  uint32_t timeout_samples_ = 0;
  uint32_t max_on_samples_ = 0;
  uint32_t late_samples_ = 0;
  uint32_t quiet_samples_ = 0;
  uint32_t on_samples_ = 0;
  uint32_t seen_beats_ = 0;
  std::array<Channel, kMaxChannels> channels_{};
  Ramp stream_gain_{};  // 2^30 for 1

  // Main loop to interrupt: one command at a time, a count of signs of life, and the stream.
  Command command_{};
  uint32_t next_phase_step_u32_ = 0;
  Waveform next_waveform_ = Waveform::kSine;
  std::atomic<bool> command_waits_{false};
  std::atomic<uint32_t> beats_{0};
  SampleStream stream_{};
  uint32_t limited_ = 0;
  // Interrupt to main loop.
  std::atomic<Output> output_{Output::kOff};
  std::atomic<FadeCause> fade_cause_{FadeCause::kNone};
  std::atomic<uint32_t> missed_{0};
  uint32_t metered_channel_ = 0;
  std::atomic<uint32_t> metered_{0};
  std::array<std::atomic<uint32_t>, kMaxChannels> duty_sums_{};
  std::array<std::atomic<uint32_t>, kMaxChannels> square_sums_{};
};

}  // namespace chladni
