// The sample interrupt's half of the synthesis: all of it is the interrupt's, but for `start` and
// the handover. Its code lies in IRAM on the chip (linker.lf).
//
// A sine's channel has an in-phase and a quadrature gain, so a new drive is reached by a straight
// ramp of those two: gain and phase change together and nothing clicks. Other waves have an
// amplitude and a phase per channel, which go straight to the next drive's, the phase by the
// shorter way round. Sines of several fingers are added up (further_voices.hpp), upon one bias.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/hal.hpp"
#include "core/synthesis/further_voices.hpp"
#include "core/synthesis/handover.hpp"
#include "core/synthesis/waves/shaper.hpp"

namespace chladni {

struct PlayerSettings {
  uint32_t channels;
  Shaper shaper;
  bool has_bridges;
  Bridge bridge;
  std::array<uint8_t, kMaxChannels> sign_pins;  // among GPIO 0 to 31
  RampRate fade;
  uint32_t signal_shift;  // of signal_ring.hpp
  // In samples: what the interrupt counts by itself.
  uint32_t touch_timeout;
  uint32_t max_on;
  uint32_t most_late;
};

class SamplePlayer {
 public:
  // Main loop, only while outputs are off.
  void start(const PlayerSettings& settings) {
    settings_ = settings;
    signs_ = 0;
    for (Channel& channel : channels_) {
      channel.mirror = 0;
      channel.errors = silence(0);
    }
  }
  // Main loop, before the first sample: the number that it gets.
  void count_from(uint32_t samples) {
    samples_ = samples;
    handover_.samples.store(samples, std::memory_order_relaxed);
  }
  // Main loop, before the first sample: where duties go.
  void connect(const Hal& hal) {
    set_duties_ = hal.set_duties;
    context_ = hal.context;
  }
  // For both contexts. It lies in here so that a sample finds it without another address.
  Handover& handover() { return handover_; }
  const Handover& handover() const { return handover_; }

  // Advance by one sample and set every channel's duty. `missed` samples before this one were never
  // asked for.
  void sample(uint32_t missed);

  // What a channel's pin has got since start, whoever played: its duty's square (in steps, over
  // 2^kSquareShift) for every sample that the duty stood. It wraps around after 13 s of full duty,
  // and outputs outlast a main loop by 6 s at most.
  uint32_t square_sum(uint32_t channel) const {
    return __atomic_load_n(&channels_[channel].square_sum, __ATOMIC_RELAXED);
  }
  static constexpr uint32_t kSquareShift = 8;
  // What it gets with each sample for as long as no other comes.
  uint32_t square(uint32_t channel) const {
    const int32_t duty = __atomic_load_n(&duties_[channel], __ATOMIC_RELAXED);
    return static_cast<uint32_t>(duty * duty) >> kSquareShift;
  }

 private:
  // Gains and amplitudes are in duty steps times 2^(fraction_bits - 15), so that the wave in Q15
  // makes them what the bias is in: duty steps times 2^fraction_bits. `..._step` times the samples
  // that are left of a ramp is what is missing from where it leads to; gains and amplitudes have 15
  // bits more there. So a ramp ends exactly, and its end costs nothing.
  struct Channel {
    int32_t first;   // sine: in-phase gain; others: amplitude
    int32_t second;  // sine: quadrature gain; others: phase of 32 bits
    int32_t bias;
    RoundingErrors errors;
    int32_t first_step;
    int32_t second_step;
    int32_t bias_step;
    // Written by the interrupt alone, in one store of a word; as an atomic, each of its accesses
    // would wait for the memory before it.
    uint32_t square_sum;
    int32_t mirror;  // of a bridge
    // Of a bridge whose next duty has the other sign: what its pin has, and who else turns.
    int32_t before;
    Channel* next_turning;
  };

  // What a sample does.
  // A fade of sines is apart, so that what plays need not look whether it ends.
  enum class Mode : uint8_t {
    kSines,
    kFadingSines,
    kVoices,  // several, or signals; fading ones too
    kOthers,
    kStream,
    kOff,
  };

  void consider_command();
  bool can_take(const Command& command) const;
  void take(const Command& command);
  void fade(FadeCause cause, RampRate rate);
  // In the settings' ramp, if outputs would be on for longer.
  void fade_soon(FadeCause cause);
  void go_off();
  void aim(Channel& channel, int32_t first, int32_t second, int32_t bias);
  // From here on biases go straight on, for another ramp to begin.
  [[gnu::always_inline]] void leave_smooth() {
    if (!is_smooth_) return;
    is_smooth_ = false;
    const int32_t more = rate_.smooth(ramp_left_) - ramp_left_;
    for (uint32_t k = 0; k < settings_.channels; ++k) {
      channels_[k].bias -= channels_[k].bias_step * more;
    }
  }
  void catch_up(uint32_t missed);
  // The one meter: a duty has stood on its pin for so many samples. Called where the next one takes
  // its place; `duties_` is what the pins have, since what was not taken is put back there.
  [[gnu::always_inline]] static void meter(Channel& channel, int32_t duty, uint32_t samples) {
    channel.square_sum += (static_cast<uint32_t>(duty * duty) >> kSquareShift) * samples;
  }
  void meter_all(uint32_t samples) {
    for (uint32_t k = 0; k < settings_.channels; ++k) meter(channels_[k], duties_[k], samples);
  }
  // Again in every sample: a channel may not have taken the 0 that ended what it played.
  void stay_off() {
    for (uint32_t k = 0; k < settings_.channels; ++k) {
      meter(channels_[k], duties_[k], 1);
      duties_[k] = 0;
    }
  }
  void settle();
  // What a channel has lost that stays at 0, its bridge's way.
  RoundingErrors silence(int32_t mirror) const {
    const int32_t lost = settings_.has_bridges && mirror == 0 ? settings_.bridge.whole : 0;
    return {lost, lost};
  }
  // One look for both: neither end is ever half the counter's range away.
  bool is_past_deadline() const {
    return static_cast<int32_t>((quiet_end_ - samples_) | (on_end_ - samples_)) < 0;
  }
  void miss_deadline();
  // No deadline is further away, in samples: a day at the fastest carrier.
  static constexpr uint32_t kFarAway = 1687500000U;
  void forget_deadlines() { quiet_end_ = on_end_ = samples_ + kFarAway; }

  Output output() const { return handover_.output.load(std::memory_order_relaxed); }
  bool is_playing() const { return output() == Output::kPlaying; }
  void advance(uint32_t count) {
    samples_ += count;
    handover_.samples.store(samples_, std::memory_order_relaxed);
  }

  // A sample in pieces that end in one another: what every sample goes through calls nothing, so
  // that few registers need be saved.
  [[gnu::noinline]] void sample_with_news(uint32_t missed);
  [[gnu::noinline]] void sample_at_deadline();
  [[gnu::noinline]] void other_sample();
  template <bool kHasBridges>
  [[gnu::always_inline]] inline void next_sines();
  bool plays_sines() const { return mode_ <= Mode::kVoices; }
  bool plays_one_sine() const { return mode_ <= Mode::kFadingSines; }
  template <bool kIsRamping>
  [[gnu::always_inline]] inline void play_mode();
  // The duties' address is made from this object's, which needs no register in the loops before:
  // the compiler must not know that it had the same address there.
  [[gnu::always_inline]] void finish() {
    SamplePlayer* own = this;
    asm("" : "+r"(own));
    own->set_duties_(own->context_, own->duties_.data(), own->signs_);
  }
  // Moved on before the channels are: one address less is needed after them.
  [[gnu::always_inline]] uint32_t next_phase() {
    const uint32_t phase = phase_u32_;
    phase_u32_ = phase + phase_step_u32_;
    return phase;
  }
  // A coil's switch has duties from 0 on, a bridge signed ones.
  template <bool kIsRamping, bool kHasBridges, bool kHasFurther>
  [[gnu::always_inline]] inline void sines();
  template <bool kIsRamping, bool kHasFurther>
  [[gnu::always_inline]] inline void sines_on_coils();
  template <bool kIsRamping>
  [[gnu::always_inline]] inline void others();
  template <bool kIsRamping, typename Wave>
  [[gnu::always_inline]] inline void like(Wave wave_q15);
  template <bool kIsRamping, bool kHasBridges, typename Wave>
  [[gnu::always_inline]] inline void like_with(Wave wave_q15);
  // What a channel's pin gets next, in place of what it has.
  template <bool kHasBridges>
  [[gnu::always_inline]] void set_next(const Shaper& shaper, const Bridge& bridge, Channel& channel,
                                       int32_t& duty, int32_t wanted) {
    if (!kHasBridges) {
      duty = static_cast<int32_t>(shaper.shape(channel.errors, wanted));
      return;
    }
    const int32_t above = bridge.above_first(channel.errors, channel.mirror, wanted);
    if (!bridge.is_plain(above)) {
      if (above == -1) {
        duty = 0;
        return;
      }
      channel.before = duty;
      channel.next_turning = turning_;
      turning_ = &channel;
    }
    duty = above + bridge.first;
  }
  // What such channels get in place of that: not in the loops over channels, which it would cost
  // registers.
  [[gnu::noinline]] void finish_turning();
  void streamed();

  // What every sample needs, where its instructions reach.
  uint32_t seen_news_ = 0;
  uint32_t samples_ = 0;  // since start
  uint32_t quiet_end_ = 0;
  uint32_t on_end_ = 0;
  Mode mode_ = Mode::kOff;
  Waveform waveform_ = Waveform::kSine;
  int32_t ramp_left_ = 0;  // samples
  uint32_t phase_u32_ = 0;
  uint32_t phase_step_u32_ = 0;
  void (*set_duties_)(void* context, int32_t* duties, uint32_t signs) = nullptr;
  void* context_ = nullptr;
  uint32_t signs_ = 0;  // of bridges: sign pins that are to be high
  Channel* turning_ = nullptr;
  std::array<int32_t, kMaxChannels> duties_{};
  std::array<Channel, kMaxChannels> channels_{};
  PlayerSettings settings_{};
  // And what only some need.
  int32_t stream_gain_q15_ = 0;  // where its ramp leads to
  int32_t stream_step_q30_ = 0;
  EdgeScale edges_{};
  RampRate rate_{};
  uint32_t seen_beats_ = 0;
  Handover handover_{};
  // Of the first voice.
  bool has_first_ = false;
  bool has_signal_ = false;
  bool waits_ = false;      // for the bias
  bool is_smooth_ = false;  // its ramp
  FurtherVoices further_{};
  // What further voices give each channel in a sample; 0 between samples.
  std::array<int32_t, kMaxChannels> further_sums_{};
};

}  // namespace chladni
