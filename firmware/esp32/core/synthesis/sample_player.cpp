// The sample interrupt's half of the synthesis; placed in IRAM on the chip (linker.lf).
#include "core/synthesis/synthesis.hpp"

namespace chladni {

namespace {

constexpr int32_t kUnityQ30 = 1 << 30;
// No deadline is further away, in samples: a day.
constexpr uint32_t kFarAway = 1U << 30;

}  // namespace

template <bool kIsRamping>
void Synthesis::sines() {
  const SineCosine wave = sine_cosine(phase_u32_);
  const Shaper shaper = shaper_;
  const int32_t left = ramp_left_;
  uint32_t* duty = duties_.data();
  Channel* const end = channels_.data() + last_channel_ + 1;
  for (Channel* channel = channels_.data(); channel != end; ++channel, ++duty) {
    int32_t in_phase = channel->first, quadrature = channel->second, wanted = channel->bias;
    if (kIsRamping) {
      in_phase -= (channel->first_step * left) >> 15;
      quadrature -= (channel->second_step * left) >> 15;
      wanted -= channel->bias_step * left;
    }
    wanted += in_phase * wave.cosine_q15 - quadrature * wave.sine_q15;
    *duty = shaper.shape(*channel, wanted);
  }
}

template <bool kIsRamping>
void Synthesis::others() {
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
void Synthesis::like(Wave wave_q15) {
  const Shaper shaper = shaper_;
  const uint32_t phase_now = phase_u32_;
  const int32_t left = ramp_left_;
  uint32_t* duty = duties_.data();
  Channel* const end = channels_.data() + last_channel_ + 1;
  for (Channel* channel = channels_.data(); channel != end; ++channel, ++duty) {
    int32_t amplitude = channel->first, wanted = channel->bias;
    uint32_t phase = phase_now + static_cast<uint32_t>(channel->second);
    if (kIsRamping) {
      amplitude -= (channel->first_step * left) >> 15;
      phase -= static_cast<uint32_t>(channel->second_step) * static_cast<uint32_t>(left);
      wanted -= channel->bias_step * left;
    }
    *duty = shaper.shape(*channel, wanted + amplitude * wave_q15(phase));
  }
}

void Synthesis::sample(const Hal& hal, uint32_t missed) {
  if ((missed | (news_.load(std::memory_order_acquire) ^ seen_news_)) != 0) {
    return sample_with_news(hal, missed);
  }
  const uint32_t samples = advance(1);
  // One look for both: neither end is ever half the counter's range away.
  if (static_cast<int32_t>((quiet_end_ - samples) | (on_end_ - samples)) < 0) {
    return sample_at_deadline(hal);
  }
  if (!plays_sines()) return other_sample(hal);
  if (ramp_left_ > 0) {
    --ramp_left_;
    sines<true>();
  } else if (mode_ == Mode::kSines) {
    sines<false>();
  } else {
    return other_sample(hal);
  }
  finish(hal);
}

void Synthesis::sample_with_news(const Hal& hal, uint32_t missed) {
  // Before what it announces is looked at: what comes later announces itself again.
  seen_news_ = news_.load(std::memory_order_acquire);
  advance(1);
  if (missed != 0) catch_up(missed);
  const uint32_t beats = beats_.load(std::memory_order_relaxed);
  if (beats != seen_beats_) {
    seen_beats_ = beats;
    quiet_end_ = samples() + timeout_samples_;
  }
  if (command_waits_.load(std::memory_order_acquire) != 0) consider_command();
  if (ramp_left_ == 0) still_silent_channels();
  const uint32_t now = samples();
  const bool is_late = static_cast<int32_t>((quiet_end_ - now) | (on_end_ - now)) < 0;
  if (is_late) return sample_at_deadline(hal);
  other_sample(hal);
}

// Errors that were left when a channel fell silent would go on being fed back.
void Synthesis::still_silent_channels() {
  for (uint32_t k = 0; k <= last_channel_; ++k) {
    if (channels_[k].bias == 0) channels_[k].error = channels_[k].older_error = 0;
  }
}

void Synthesis::sample_at_deadline(const Hal& hal) {
  miss_deadline();
  other_sample(hal);
}

template <bool kIsRamping>
void Synthesis::play_mode() {
  if (plays_sines()) {
    sines<kIsRamping>();
  } else if (mode_ == Mode::kOthers) {
    others<kIsRamping>();
  } else if (mode_ == Mode::kStream) {
    streamed();
  }
}

void Synthesis::other_sample(const Hal& hal) {
  if (ramp_left_ > 0) {
    --ramp_left_;
    play_mode<true>();
  } else if (output_.load(std::memory_order_relaxed) == Output::kFading) {
    go_off();
  } else {
    play_mode<false>();
  }
  finish(hal);
}

void Synthesis::finish(const Hal& hal) {
  phase_u32_ += phase_step_u32_;
  hal.set_duties(hal.context, duties_.data());
}

void Synthesis::streamed() {
  const bool has_frame = stream_.next(duties_.data());
  if (!has_frame && output_.load(std::memory_order_relaxed) == Output::kPlaying) {
    fade(FadeCause::kUnderrun, fade_rate_);
  }
  const int32_t gain_q15 = stream_gain_q15_ - ((stream_step_q30_ * ramp_left_) >> 15);
  for (uint32_t k = 0; k <= last_channel_; ++k) {
    // A duty of 16 bits halved times a gain of 15 is one with 30 bits: a step has the rest.
    duties_[k] = shaper_.shape(channels_[k], static_cast<int32_t>(duties_[k] >> 1) * gain_q15);
  }
}

void Synthesis::consider_command() {
  if (can_take(command_)) {
    take(command_);
    command_waits_.store(0, std::memory_order_release);
    return;
  }
  --seen_news_;  // it is looked at again in the next sample
  const bool is_at_odds =
      mode_ == Mode::kStream || command_.waveform != waveform_ || command_.kind == Kind::kStream;
  if (is_at_odds && ramp_left_ == 0 &&
      output_.load(std::memory_order_relaxed) == Output::kPlaying) {
    fade(FadeCause::kReleased, fade_rate_);  // what is playing makes room
  }
}

bool Synthesis::can_take(const Command& command) const {
  const Output output = output_.load(std::memory_order_relaxed);
  if (output == Output::kOff || command.kind == Kind::kRelease) return true;
  const bool is_stream = mode_ == Mode::kStream;
  if (command.kind == Kind::kStream || (is_stream && command.starts_touch)) return false;
  return !command.starts_touch || command.waveform == waveform_;
}

void Synthesis::take(const Command& command) {
  const Output output = output_.load(std::memory_order_relaxed);
  if (command.kind == Kind::kRelease) {
    if (output == Output::kPlaying) fade(FadeCause::kReleased, command.rate);
    return;
  }
  // A move comes too late once a deadline has ended its touch: only a new touch starts the clock.
  const bool is_playing_waves = output == Output::kPlaying && mode_ != Mode::kStream;
  if (!command.starts_touch && !is_playing_waves) return;
  // From silence every wave starts at the same phase, so the same touch plays the same.
  if (output == Output::kOff) phase_u32_ = 0;
  quiet_end_ = samples() + timeout_samples_;
  if (command.starts_touch) {
    on_end_ = samples() + max_on_samples_;
    phase_step_u32_ = command.phase_step_u32;
    waveform_ = command.waveform;
    edges_ = command.edges;
  }
  rate_ = command.rate;
  output_.store(Output::kPlaying, std::memory_order_release);
  if (command.kind == Kind::kStream) {
    // A stream may outlast a touch; coil heat ends it where it must (device.cpp).
    on_end_ = samples() + kFarAway;
    mode_ = Mode::kStream;
    stream_gain_q15_ = 1 << 15;
    stream_step_q30_ = step(0, kUnityQ30);
  } else {
    mode_ = waveform_ == Waveform::kSine ? Mode::kSines : Mode::kOthers;
    for (uint32_t k = 0; k <= last_channel_; ++k) {
      aim(channels_[k], command.first[k], command.second[k], command.bias[k]);
    }
  }
  ramp_left_ = rate_.samples;
}

void Synthesis::fade(FadeCause cause, RampRate rate) {
  if (mode_ == Mode::kFadingSines) mode_ = Mode::kSines;
  rate_ = rate;
  forget_deadlines();
  for (uint32_t k = 0; k <= last_channel_; ++k) {
    // A wave other than a sine fades out in the phase that it was going to.
    aim(channels_[k], 0, plays_sines() ? 0 : channels_[k].second, 0);
  }
  stream_step_q30_ = step(stream_gain_q15_ * (1 << 15) - stream_step_q30_ * ramp_left_, 0);
  stream_gain_q15_ = 0;
  if (mode_ == Mode::kSines) mode_ = Mode::kFadingSines;
  ramp_left_ = rate_.samples;
  fade_cause_.store(cause, std::memory_order_release);
  output_.store(Output::kFading, std::memory_order_release);
}

int32_t Synthesis::step(int32_t from, int32_t to) const {
  // The upper 16 bits alone: what is lost, an eighth of a duty step at 10 bits, is made up for at
  // once when the ramp begins.
  return (((to - from) >> 16) * rate_.factor) >> rate_.shift;
}

// From where a channel is to a new drive; `first` and a sine's `second` with 15 bits more.
void Synthesis::aim(Channel& channel, int32_t first, int32_t second, int32_t bias) {
  const int32_t left = ramp_left_;
  const int32_t first_now = channel.first * (1 << 15) - channel.first_step * left;
  if (plays_sines()) {
    const int32_t second_now = channel.second * (1 << 15) - channel.second_step * left;
    channel.second_step = step(second_now, second);
    channel.second = second >> 15;
  } else {
    // The shorter way round, by the overflow; from silence there is none to go.
    const uint32_t phase_now =
        static_cast<uint32_t>(channel.second) -
        static_cast<uint32_t>(channel.second_step) * static_cast<uint32_t>(left);
    const auto way = static_cast<int32_t>(static_cast<uint32_t>(second) - phase_now);
    channel.second_step = first_now == 0 ? 0 : step(0, way);
    channel.second = second;
  }
  channel.first_step = step(first_now, first);
  channel.first = first >> 15;
  channel.bias_step = step(channel.bias - channel.bias_step * left, bias);
  channel.bias = bias;
}

void Synthesis::go_off() {
  for (uint32_t k = 0; k <= last_channel_; ++k) {
    // A fade has brought the rest to 0.
    channels_[k].second = channels_[k].error = channels_[k].older_error = 0;
    duties_[k] = 0;
  }
  stream_gain_q15_ = stream_step_q30_ = 0;
  ramp_left_ = 0;
  mode_ = Mode::kOff;
  forget_deadlines();
  output_.store(Output::kOff, std::memory_order_release);
}

void Synthesis::catch_up(uint32_t missed) {
  missed_.store(missed_.load(std::memory_order_relaxed) + missed, std::memory_order_relaxed);
  advance(missed);
  phase_u32_ += phase_step_u32_ * missed;
  const bool is_playing = output_.load(std::memory_order_relaxed) == Output::kPlaying;
  if (missed >= late_samples_ && is_playing) fade(FadeCause::kLate, fade_rate_);
}

void Synthesis::miss_deadline() {
  const bool is_spent = static_cast<int32_t>(on_end_ - samples()) < 0;
  const bool is_playing = output_.load(std::memory_order_relaxed) == Output::kPlaying;
  forget_deadlines();
  if (is_playing) fade(is_spent ? FadeCause::kMaxOn : FadeCause::kTouchTimeout, fade_rate_);
}

void Synthesis::forget_deadlines() { quiet_end_ = on_end_ = samples() + kFarAway; }

}  // namespace chladni
