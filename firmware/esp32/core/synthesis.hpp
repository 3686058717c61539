// Up to sixteen PWM sine waves of one frequency from a 32-bit phase, one sample per call.
//
// Each channel has an in-phase and a quadrature gain, so a new drive is reached by a straight ramp
// of those two: gain and phase change together and nothing clicks. The outputs switch current one
// way only, so a bias rides under every sine, as large as its amplitude needs and ramped with it.
// Duties are rounded with the error of the last two samples fed back, which moves the rounding
// noise above the band a finger feels.
//
// `Synthesis::sample` belongs to the sample interrupt; every other member to the main loop.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/hal.hpp"

namespace chladni {

constexpr uint32_t kMaxChannels = 16;
constexpr uint32_t kCarrierPeriodsPerSample = 4;

// In-phase and quadrature gain of one channel: the wave is I cos(wt) - Q sin(wt).
struct Gain {
  int16_t in_phase_q15;
  int16_t quadrature_q15;
};

using Drive = std::array<Gain, kMaxChannels>;

struct SynthesisSettings {
  uint32_t channels;          // 1 to kMaxChannels
  uint32_t pwm_bits;          // 10 to 12; the carrier is 80 MHz / 2^bits
  uint32_t frequency_mhz;     // of the wave, millihertz
  uint32_t ramp_us;           // time from one drive to the next
  uint32_t touch_timeout_us;  // outputs fade out when nobody says "still touched" for this long
  uint32_t max_on_us;         // and after this in any case
};

// Largest amplitude in duty steps. Two steps above and below are the shaper's own.
constexpr uint32_t half_span_steps(uint32_t pwm_bits) { return (1U << (pwm_bits - 1)) - 3U; }
constexpr uint32_t kBiasMarginSteps = 2;

// Sample rate 80 MHz / 2^bits / 4; `frequency_mhz` must be below half of it.
uint32_t phase_step_u32(uint32_t frequency_mhz, uint32_t pwm_bits);
uint32_t samples_in(uint32_t microseconds, uint32_t pwm_bits);

enum class Output : uint8_t {
  kOff,      // duty 0 on every channel
  kPlaying,  // a drive, or on the way to one
  kFading,   // on the way to off
};

enum class FadeCause : uint8_t {
  kNone,
  kReleased,      // the main loop asked for it
  kTouchTimeout,  // no sign of the touch for touch_timeout_us
  kMaxOn,         // on for max_on_us
};

const char* to_text(FadeCause cause);

class Synthesis {
 public:
  // Outputs are off until the first drive. False if a setting is out of range.
  bool start(const SynthesisSettings& settings);

  // Go to a drive, scaled by `level_q15` (0 to 32767). `starts_touch` starts the on-time anew;
  // without it the drive is a move within a touch, and void if that touch has been ended.
  // False while the last command waits to be taken.
  bool play(const Drive& drive, uint32_t level_q15, bool starts_touch);
  // Waves of the touches that start from now on; false if out of range.
  bool set_frequency(uint32_t frequency_mhz);
  // Fade out.
  bool release();
  // The finger is still there.
  void keep_alive();

  // Advance by one sample and set every channel's duty. Interrupt only.
  void sample(const Hal& hal);

  Output output() const { return output_.load(std::memory_order_acquire); }
  FadeCause fade_cause() const { return fade_cause_.load(std::memory_order_acquire); }

 private:
  struct Command {
    bool is_release;
    bool starts_touch;
    uint32_t phase_step_u32;  // taken by a drive that starts a touch
    std::array<int32_t, kMaxChannels> in_phase_q30;
    std::array<int32_t, kMaxChannels> quadrature_q30;
    std::array<int32_t, kMaxChannels> bias_q16;
  };

  // A value that moves in equal steps and lands exactly.
  struct Ramp {
    int32_t value;
    int32_t step;
    int32_t end;
  };

  struct Channel {
    Ramp in_phase_q30;
    Ramp quadrature_q30;
    Ramp bias_q16;
    int32_t error_q16;
    int32_t older_error_q16;
  };

  bool post(const Command& command);
  void take(const Command& command);
  void fade(FadeCause cause);
  void aim(Ramp& ramp, int32_t end) const;
  uint32_t shape(Channel& channel, const struct SineCosine& wave) const;
  void watch_deadlines();

  SynthesisSettings settings_{};
  uint32_t phase_u32_ = 0;
  uint32_t phase_step_u32_ = 0;
  int32_t half_span_ = 0;
  int32_t max_duty_ = 0;
  int32_t ramp_samples_ = 1;
  int32_t ramp_left_ = 0;
  uint32_t timeout_samples_ = 0;
  uint32_t max_on_samples_ = 0;
  uint32_t quiet_samples_ = 0;
  uint32_t on_samples_ = 0;
  uint32_t seen_beats_ = 0;
  std::array<Channel, kMaxChannels> channels_{};

  // Main loop to interrupt: one command at a time, and a count of signs of life.
  Command command_{};
  uint32_t next_phase_step_u32_ = 0;
  std::atomic<bool> command_waits_{false};
  std::atomic<uint32_t> beats_{0};
  // Interrupt to main loop.
  std::atomic<Output> output_{Output::kOff};
  std::atomic<FadeCause> fade_cause_{FadeCause::kNone};
};

}  // namespace chladni
