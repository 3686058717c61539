// The sample interrupt's waves that are no sines: templates of SamplePlayer, which
// sample_player.cpp alone includes, so that they lie where the rest of it lies.
#pragma once

#include "core/synthesis/sample_player.hpp"

namespace chladni {

template <bool kIsRamping>
void SamplePlayer::others() {
  const EdgeScale& edges = edges_;
  if (waveform_ == Waveform::kTriangle) {
    like<kIsRamping>([](uint32_t phase) { return triangle_q15(phase); });
  } else if (waveform_ == Waveform::kSquare) {
    like<kIsRamping>([&edges](uint32_t phase) { return square_q15(phase, edges); });
  } else {
    like<kIsRamping>([&edges](uint32_t phase) { return ramp_q15(phase, edges); });
  }
}

template <bool kIsRamping, typename Wave>
void SamplePlayer::like(Wave wave_q15) {
  if (settings_.has_bridges) {
    like_with<kIsRamping, true>(wave_q15);
  } else {
    like_with<kIsRamping, false>(wave_q15);
  }
}

template <bool kIsRamping, bool kHasBridges, typename Wave>
void SamplePlayer::like_with(Wave wave_q15) {
  const Shaper shaper = settings_.shaper;
  const Bridge bridge = settings_.bridge;
  const uint32_t phase_now = next_phase();
  const int32_t left = ramp_left_;
  int32_t* duty = duties_.data();
  Channel* const end = channels_.data() + settings_.channels;
  for (Channel* channel = channels_.data(); channel != end; ++channel, ++duty) {
    int32_t amplitude = channel->first, wanted = kHasBridges ? 0 : channel->bias;
    uint32_t phase = phase_now + static_cast<uint32_t>(channel->second);
    if (kIsRamping) {
      amplitude -= (channel->first_step * left) >> 15;
      phase -= static_cast<uint32_t>(channel->second_step) * static_cast<uint32_t>(left);
      if (!kHasBridges) wanted -= channel->bias_step * left;
    }
    meter(*channel, *duty, 1);
    wanted += amplitude * wave_q15(phase);
    set_next<kHasBridges>(shaper, bridge, *channel, *duty, wanted);
  }
}

}  // namespace chladni
