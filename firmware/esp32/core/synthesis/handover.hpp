// What passes between the main loop and the sample interrupt. All else of the synthesis belongs to
// one of the two: `Synthesis` to the main loop, `SamplePlayer` to the interrupt.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/synthesis/output_limits.hpp"
#include "core/synthesis/rings/duty_ring.hpp"
#include "core/synthesis/rings/signal_ring.hpp"
#include "core/synthesis/waves/waveform.hpp"

namespace chladni {

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

enum class Stop : uint8_t {
  kNo,
  kFade,    // in the settings' ramp
  kAtOnce,  // in the next sample
};

// How far a ramp goes per sample, without a division: (way >> 16) * factor >> shift.
struct RampRate {
  int32_t samples = 1;
  int32_t factor = 0;
  uint32_t shift = 0;

  // The upper 16 bits alone: what is lost, an eighth of a duty step at 10 bits, is made up for at
  // once when the ramp begins.
  // Halved first: a bridge's way is up to twice its range.
  [[gnu::always_inline]] int32_t step(int32_t from, int32_t to) const {
    return (((to >> 1) - (from >> 1)) >> 15) * factor >> shift;
  }

  // What is left of a way that begins and ends slowly, in samples of one that does not: 3p² − 2p³
  // of all of them, where p of them are left.
  [[gnu::always_inline]] int32_t smooth(int32_t left) const {
    const uint32_t p_q15 =
        static_cast<uint32_t>(left) * static_cast<uint32_t>(factor) >> shift >> 1;
    const uint32_t share_q15 = ((p_q15 * p_q15 >> 15) * (98304U - 2U * p_q15)) >> 15;
    return static_cast<int32_t>(static_cast<uint32_t>(samples) * share_q15 >> 15);
  }
};

// Of fingers that each have a signal of their own.
constexpr uint32_t kMaxVoices = 5, kFurtherVoices = kMaxVoices - 1;

// What a voice beside the first gives the channels.
struct FurtherGains {
  uint32_t phase_step_u32;
  std::array<int32_t, kMaxChannels> in_phase;
  std::array<int32_t, kMaxChannels> quadrature;
};

// What the main loop asks of the outputs.
struct Command {
  enum class Kind : uint8_t { kDrive, kStream, kRelease };

  Kind kind;
  bool starts_touch;
  bool is_smooth;  // biases begin and end slowly
  Waveform waveform;
  RampRate rate;
  uint32_t voices;          // that sound, a bit each from the first on
  uint32_t signals;         // voices that play what is pushed for them instead of a sine
  uint32_t phase_step_u32;  // of the first voice
  EdgeScale edges;
  // Of the first voice. Sine: the two gains. Others: amplitude, and phase as an unsigned number.
  std::array<int32_t, kMaxChannels> first;
  std::array<int32_t, kMaxChannels> second;
  std::array<int32_t, kMaxChannels> bias;  // of all voices
  // Read of voices that sound.
  std::array<FurtherGains, kFurtherVoices> further;
};

struct Handover {
  // Main loop to interrupt. `news` counts how often there was something and is written last, so
  // that a sample has one number to look at.
  std::atomic<uint32_t> news{0};
  std::atomic<uint32_t> beats{0};  // signs that the finger, or the host, is still there
  // Set by the main loop once `command` is written, and cleared by the interrupt that has taken it:
  // the main loop writes only while it is 0, the interrupt reads only while it is 1.
  std::atomic<uint32_t> command_waits{0};
  // Whatever plays or waits; a command that waits is void. Cleared by the interrupt.
  std::atomic<Stop> must_stop{Stop::kNo};

  // Interrupt to main loop.
  std::atomic<uint32_t> samples{0};  // since start
  std::atomic<uint32_t> missed{0};   // of them
  std::atomic<uint32_t> begun{0};    // the first that was not silent: its phase is 0
  std::atomic<Output> output{Output::kOff};
  // Wiped out by the main loop when it asks for the start of a touch.
  std::atomic<FadeCause> fade_cause{FadeCause::kNone};

  Command command{};
  DutyRing stream{};
  std::array<SignalRing, kMaxVoices> signals{};
};

}  // namespace chladni
