// The voices beside the first, for the sample interrupt: each a sine with a phase of its own, and
// an in-phase and a quadrature gain per channel, or a signal (signal_ring.hpp), which is in phase
// everywhere. They ramp with the first voice, along the same lines.
//
// All of it is inlined into sample_player.cpp: a copy of its own would lie in flash.
#pragma once

#include <array>
#include <cstdint>

#include "core/synthesis/handover.hpp"
#include "core/synthesis/waves/sine.hpp"

namespace chladni {

class FurtherVoices {
 public:
  bool are_sounding() const { return sounding_ != 0; }

  // What they give each channel in this sample is added to its sum; their phases go on.
  // `signals` has one for each.
  template <bool kIsRamping>
  [[gnu::always_inline]] void add_to(int32_t* sums, uint32_t channels, int32_t left,
                                     SignalRing* signals, uint32_t shift) {
    Voice* voice = voices_.data();
    for (uint32_t rest = sounding_; rest != 0; rest >>= 1, ++voice, ++signals) {
      if ((rest & 1U) == 0) continue;
      SineCosine wave{};
      if (voice->has_signal) {
        if (!kIsRamping || !voice->waits) wave.cosine_q15 = signals->next(shift);
      } else {
        wave = sine_cosine(voice->phase_u32);
        voice->phase_u32 += voice->phase_step_u32;
      }
      int32_t* sum = sums;
      const Channel* const end = voice->channels.data() + channels;
      for (const Channel* channel = voice->channels.data(); channel != end; ++channel, ++sum) {
        int32_t in_phase = channel->in_phase, quadrature = channel->quadrature;
        if (kIsRamping) {
          in_phase -= (channel->in_phase_step * left) >> 15;
          quadrature -= (channel->quadrature_step * left) >> 15;
        }
        *sum += in_phase * wave.cosine_q15 - quadrature * wave.sine_q15;
      }
    }
  }

  // From where they are, `left` samples before a ramp's end, to the gains of a command. One that
  // was silent begins at the same phase each time; a signal, which begins and ends by itself, has
  // its gains at once, and waits for the ramp's end where a bias comes up (`has_bias`).
  [[gnu::always_inline]] void aim(const Command& command, uint32_t channels, RampRate rate,
                                  int32_t left, SignalRing* signals, bool has_bias) {
    const uint32_t wanted = command.voices >> 1;
    for (uint32_t v = 0; (sounding_ | wanted) >> v != 0; ++v) {
      const bool was_sounding = (sounding_ >> v & 1U) != 0, is_wanted = (wanted >> v & 1U) != 0;
      if (!was_sounding && !is_wanted) continue;
      Voice& voice = voices_[v];
      const FurtherGains& gains = command.further[v];
      voice.phase_step_u32 = gains.phase_step_u32;
      if (is_wanted) voice.has_signal = (command.signals >> (v + 1U) & 1U) != 0;
      if (!was_sounding) voice.phase_u32 = 0;
      const bool is_at_once = !was_sounding && voice.has_signal;
      if (is_at_once) signals[v].start();
      voice.waits = is_at_once && has_bias;
      const int32_t left_of_it = was_sounding ? left : 0;  // else its steps are of a ramp long ago
      for (uint32_t k = 0; k < channels; ++k) {
        Channel& channel = voice.channels[k];
        aim_one(channel.in_phase, channel.in_phase_step, is_wanted ? gains.in_phase[k] : 0, rate,
                left_of_it);
        aim_one(channel.quadrature, channel.quadrature_step, is_wanted ? gains.quadrature[k] : 0,
                rate, left_of_it);
        if (is_at_once) channel.in_phase_step = channel.quadrature_step = 0;
      }
    }
    sounding_ |= wanted;
    wanted_ = wanted;
  }

  // All of them to silence.
  [[gnu::always_inline]] void fade(uint32_t channels, RampRate rate, int32_t left) {
    Voice* voice = voices_.data();
    for (uint32_t rest = sounding_; rest != 0; rest >>= 1, ++voice) {
      if ((rest & 1U) == 0) continue;
      for (uint32_t k = 0; k < channels; ++k) {
        Channel& channel = voice->channels[k];
        aim_one(channel.in_phase, channel.in_phase_step, 0, rate, left);
        aim_one(channel.quadrature, channel.quadrature_step, 0, rate, left);
      }
    }
    wanted_ = 0;
  }

  // At a ramp's end: those that were to fall silent have, in all their channels.
  void settle() { sounding_ = wanted_; }
  // Without a ramp.
  [[gnu::always_inline]] void go_off(uint32_t channels) {
    for (uint32_t v = 0; sounding_ >> v != 0; ++v) {
      for (uint32_t k = 0; k < channels; ++k) {
        Channel& channel = voices_[v].channels[k];
        channel.in_phase = channel.quadrature = 0;
        channel.in_phase_step = channel.quadrature_step = 0;
      }
    }
    sounding_ = wanted_ = 0;
  }

  // Samples that were never asked for.
  [[gnu::always_inline]] void skip(uint32_t samples) {
    for (uint32_t v = 0; sounding_ >> v != 0; ++v) {
      voices_[v].phase_u32 += voices_[v].phase_step_u32 * samples;
    }
  }

  // Once no ramp is under way.
  [[gnu::always_inline]] bool is_silent(uint32_t channel) const {
    int32_t any = 0;
    for (uint32_t v = 0; sounding_ >> v != 0; ++v) {
      const Channel& own = voices_[v].channels[channel];
      any |= own.in_phase | own.quadrature;
    }
    return any == 0;
  }

 private:
  // As in SamplePlayer::Channel. Of a voice that does not sound, the gains are 0.
  struct Channel {
    int32_t in_phase;
    int32_t quadrature;
    int32_t in_phase_step;
    int32_t quadrature_step;
  };
  struct Voice {
    uint32_t phase_u32;
    uint32_t phase_step_u32;
    bool has_signal;
    bool waits;
    std::array<Channel, kMaxChannels> channels;
  };

  // `wanted` with 15 bits more than the gain.
  [[gnu::always_inline]] static void aim_one(int32_t& gain, int32_t& gain_step, int32_t wanted,
                                             RampRate rate, int32_t left) {
    gain_step = rate.step(gain * (1 << 15) - gain_step * left, wanted);
    gain = wanted >> 15;
  }

  uint32_t sounding_ = 0;  // a bit each, from the second voice on
  uint32_t wanted_ = 0;    // those that sound once the ramp has ended
  std::array<Voice, kFurtherVoices> voices_{};
};

}  // namespace chladni
