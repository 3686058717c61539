#include "core/synthesis/sample_player.hpp"

#include "core/synthesis/other_waves.hpp"
#include "core/synthesis/waves/sine.hpp"

namespace chladni {

namespace {

using Kind = Command::Kind;

constexpr int32_t kUnityQ30 = 1 << 30;

}  // namespace

template <bool kIsRamping, bool kHasBridges, bool kHasFurther>
void SamplePlayer::sines() {
  int32_t* further = further_sums_.data();
  SineCosine wave{};
  if (kHasFurther) {
    SignalRing* const signals = handover_.signals.data();
    const uint32_t shift = settings_.signal_shift;
    further_.add_to<kIsRamping>(further, settings_.channels, ramp_left_, signals + 1, shift);
    if (has_signal_ && (!kIsRamping || !waits_)) wave.cosine_q15 = signals->next(shift);
  }
  if (!kHasFurther || !has_signal_) wave = sine_cosine(next_phase());
  const Shaper shaper = settings_.shaper;
  const Bridge bridge = settings_.bridge;
  const int32_t left = ramp_left_;
  // Nothing waits for a bias but signals, which are voices.
  const int32_t bias_left = kIsRamping && kHasFurther && is_smooth_ ? rate_.smooth(left) : left;
  int32_t* duty = duties_.data();
  Channel* const end = channels_.data() + settings_.channels;
  for (Channel* channel = channels_.data(); channel != end; ++channel, ++duty) {
    meter(*channel, *duty, 1);
    int32_t in_phase = channel->first, quadrature = channel->second;
    int32_t wanted = kHasBridges ? 0 : channel->bias;
    if (kIsRamping) {
      in_phase -= (channel->first_step * left) >> 15;
      quadrature -= (channel->second_step * left) >> 15;
      if (!kHasBridges) wanted -= channel->bias_step * bias_left;
    }
    wanted += in_phase * wave.cosine_q15 - quadrature * wave.sine_q15;
    if (kHasFurther) {
      wanted += *further;
      *further++ = 0;
    }
    set_next<kHasBridges>(shaper, bridge, *channel, *duty, wanted);
  }
}

void SamplePlayer::sample(uint32_t missed) {
  if ((missed | (handover_.news.load(std::memory_order_acquire) ^ seen_news_)) != 0) {
    return sample_with_news(missed);
  }
  advance(1);
  if (is_past_deadline()) return sample_at_deadline();
  if (!plays_one_sine()) return other_sample();
  if (settings_.has_bridges) return next_sines<true>();
  next_sines<false>();
}

template <bool kHasBridges>
void SamplePlayer::next_sines() {
  if (ramp_left_ > 0) {
    --ramp_left_;
    sines<true, kHasBridges, false>();
  } else if (mode_ == Mode::kSines) {
    sines<false, kHasBridges, false>();
  } else {
    return other_sample();
  }
  if (kHasBridges && turning_ != nullptr) return finish_turning();
  finish();
}

void SamplePlayer::finish_turning() {
  const Bridge bridge = settings_.bridge;
  for (Channel* channel = turning_; channel != nullptr; channel = channel->next_turning) {
    const auto k = static_cast<uint32_t>(channel - channels_.data());
    const int32_t way = channel->mirror, above = duties_[k] - bridge.first;
    duties_[k] = bridge.turned(channel->errors, channel->mirror, channel->before, above);
    if (channel->mirror != way) signs_ ^= 1U << settings_.sign_pins[k];
  }
  turning_ = nullptr;
  finish();
}

void SamplePlayer::sample_with_news(uint32_t missed) {
  // Before what it announces is looked at: what comes later announces itself again.
  seen_news_ = handover_.news.load(std::memory_order_acquire);
  advance(1);
  if (missed != 0) catch_up(missed);
  const uint32_t beats = handover_.beats.load(std::memory_order_relaxed);
  if (beats != seen_beats_) {
    seen_beats_ = beats;
    quiet_end_ = samples_ + settings_.touch_timeout;
  }
  const Stop stop = handover_.must_stop.load(std::memory_order_acquire);
  if (stop != Stop::kNo) {
    if (stop == Stop::kAtOnce) {
      go_off();
    } else {
      fade_soon(FadeCause::kReleased);
    }
    handover_.command_waits.store(0, std::memory_order_release);
    handover_.must_stop.store(Stop::kNo, std::memory_order_release);
  } else if (handover_.command_waits.load(std::memory_order_acquire) != 0) {
    // Not in a sample that went off: duties are 0 there, and pins have still their pulses.
    consider_command();
  }
  if (ramp_left_ == 0) settle();
  if (is_past_deadline()) return sample_at_deadline();
  other_sample();
}

// No ramp is under way. Errors that were left when a channel fell silent would go on being fed
// back.
void SamplePlayer::settle() {
  further_.settle();
  const bool is_one_sine = !further_.are_sounding() && !has_signal_;
  if (mode_ == Mode::kVoices && is_playing() && is_one_sine) mode_ = Mode::kSines;
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    Channel& own = channels_[k];
    const bool is_silent = own.first == 0 && (own.second == 0 || !plays_sines());
    if (own.bias == 0 && is_silent && further_.is_silent(k)) own.errors = silence(own.mirror);
  }
}

void SamplePlayer::sample_at_deadline() {
  miss_deadline();
  other_sample();
}

template <bool kIsRamping, bool kHasFurther>
void SamplePlayer::sines_on_coils() {
  if (settings_.has_bridges) {
    sines<kIsRamping, true, kHasFurther>();
  } else {
    sines<kIsRamping, false, kHasFurther>();
  }
}

template <bool kIsRamping>
void SamplePlayer::play_mode() {
  if (plays_one_sine()) {
    sines_on_coils<kIsRamping, false>();
  } else if (mode_ == Mode::kVoices) {
    sines_on_coils<kIsRamping, true>();
  } else if (mode_ == Mode::kOthers) {
    others<kIsRamping>();
  } else if (mode_ == Mode::kStream) {
    streamed();
  } else {
    stay_off();
  }
}

void SamplePlayer::other_sample() {
  if (ramp_left_ > 0) {
    --ramp_left_;
    play_mode<true>();
  } else if (output() == Output::kFading) {
    go_off();
  } else {
    play_mode<false>();
  }
  if (turning_ != nullptr) return finish_turning();
  finish();
}

void SamplePlayer::streamed() {
  meter_all(1);
  std::array<int32_t, kMaxChannels> frame;
  const bool has_frame = handover_.stream.next(frame.data());
  if (!has_frame && is_playing()) fade(FadeCause::kUnderrun, settings_.fade);
  const Shaper shaper = settings_.shaper;
  const Bridge bridge = settings_.bridge;
  const int32_t gain_q15 = stream_gain_q15_ - ((stream_step_q30_ * ramp_left_) >> 15);
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    // A duty of 15 bits times a gain of 15 is one with 30 bits: a step has the rest.
    const int32_t wanted = frame[k] * gain_q15;
    if (settings_.has_bridges) {
      set_next<true>(shaper, bridge, channels_[k], duties_[k], wanted);
    } else {
      set_next<false>(shaper, bridge, channels_[k], duties_[k], wanted);
    }
  }
}

void SamplePlayer::consider_command() {
  const Command& command = handover_.command;
  if (can_take(command)) {
    take(command);
    handover_.command_waits.store(0, std::memory_order_release);
    return;
  }
  --seen_news_;  // it is looked at again in the next sample
  const bool is_at_odds =
      mode_ == Mode::kStream || command.waveform != waveform_ || command.kind == Kind::kStream;
  if (is_at_odds && is_playing()) {
    fade(FadeCause::kReleased, settings_.fade);  // what is playing makes room
  }
}

bool SamplePlayer::can_take(const Command& command) const {
  if (output() == Output::kOff || command.kind == Kind::kRelease) return true;
  const bool is_stream = mode_ == Mode::kStream;
  if (command.kind == Kind::kStream || (is_stream && command.starts_touch)) return false;
  return !command.starts_touch || command.waveform == waveform_;
}

void SamplePlayer::take(const Command& command) {
  if (command.kind == Kind::kRelease) {
    if (is_playing()) fade(FadeCause::kReleased, command.rate);
    return;
  }
  // A move comes too late once a deadline has ended its touch: only a new touch starts the clock.
  const bool is_playing_waves = is_playing() && mode_ != Mode::kStream;
  if (!command.starts_touch && !is_playing_waves) return;
  // From silence every wave starts at the same phase, so the same touch plays the same.
  if (output() == Output::kOff) {
    phase_u32_ = 0;
    handover_.begun.store(samples_, std::memory_order_relaxed);
  }
  quiet_end_ = samples_ + settings_.touch_timeout;
  phase_step_u32_ = command.phase_step_u32;
  if (command.starts_touch) {
    on_end_ = samples_ + settings_.max_on;
    waveform_ = command.waveform;
    edges_ = command.edges;
  }
  leave_smooth();
  rate_ = command.rate;
  handover_.output.store(Output::kPlaying, std::memory_order_release);
  if (command.kind == Kind::kStream) {
    // A stream may outlast a touch; coil heat ends it where it must (device.cpp).
    on_end_ = samples_ + kFarAway;
    mode_ = Mode::kStream;
    stream_gain_q15_ = 1 << 15;
    stream_step_q30_ = rate_.step(0, kUnityQ30);
  } else {
    further_.aim(command, settings_.channels, rate_, ramp_left_, handover_.signals.data() + 1,
                 !settings_.has_bridges);
    const bool had_first = has_first_;
    has_first_ = (command.voices & 1U) != 0;
    if (has_first_) has_signal_ = (command.signals & 1U) != 0;
    const bool is_at_once = has_signal_ && has_first_ && !had_first;
    if (is_at_once) handover_.signals[0].start();
    waits_ = is_at_once && !settings_.has_bridges;
    mode_ = further_.are_sounding() || has_signal_ ? Mode::kVoices : Mode::kSines;
    if (waveform_ != Waveform::kSine) mode_ = Mode::kOthers;
    for (uint32_t k = 0; k < settings_.channels; ++k) {
      aim(channels_[k], command.first[k], command.second[k], command.bias[k]);
      if (is_at_once) channels_[k].first_step = channels_[k].second_step = 0;
    }
  }
  is_smooth_ = command.is_smooth;
  ramp_left_ = rate_.samples;
}

void SamplePlayer::fade(FadeCause cause, RampRate rate) {
  if (mode_ == Mode::kFadingSines) mode_ = Mode::kSines;
  leave_smooth();
  rate_ = rate;
  forget_deadlines();
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    // A wave other than a sine fades out in the phase that it was going to.
    aim(channels_[k], 0, plays_sines() ? 0 : channels_[k].second, 0);
  }
  further_.fade(settings_.channels, rate_, ramp_left_);
  stream_step_q30_ = rate_.step(stream_gain_q15_ * (1 << 15) - stream_step_q30_ * ramp_left_, 0);
  stream_gain_q15_ = 0;
  if (mode_ == Mode::kSines) mode_ = Mode::kFadingSines;
  ramp_left_ = rate_.samples;
  handover_.fade_cause.store(cause, std::memory_order_release);
  handover_.output.store(Output::kFading, std::memory_order_release);
}

void SamplePlayer::fade_soon(FadeCause cause) {
  const bool is_sooner = output() == Output::kFading && settings_.fade.samples < ramp_left_;
  if (is_playing() || is_sooner) fade(cause, settings_.fade);
}

// From where a channel is to a new drive; `first` and a sine's `second` with 15 bits more.
void SamplePlayer::aim(Channel& channel, int32_t first, int32_t second, int32_t bias) {
  const int32_t left = ramp_left_;
  const int32_t first_now = channel.first * (1 << 15) - channel.first_step * left;
  if (plays_sines()) {
    const int32_t second_now = channel.second * (1 << 15) - channel.second_step * left;
    channel.second_step = rate_.step(second_now, second);
    channel.second = second >> 15;
  } else {
    // The shorter way round, by the overflow; from silence there is none to go.
    const uint32_t phase_now =
        static_cast<uint32_t>(channel.second) -
        static_cast<uint32_t>(channel.second_step) * static_cast<uint32_t>(left);
    const auto way = static_cast<int32_t>(static_cast<uint32_t>(second) - phase_now);
    channel.second_step = first_now == 0 ? 0 : rate_.step(0, way);
    channel.second = second;
  }
  channel.first_step = rate_.step(first_now, first);
  channel.first = first >> 15;
  channel.bias_step = rate_.step(channel.bias - channel.bias_step * left, bias);
  channel.bias = bias;
}

void SamplePlayer::go_off() {
  meter_all(1);
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    Channel& channel = channels_[k];
    const RoundingErrors errors = silence(channel.mirror);
    channel = {0, 0, 0, errors, 0, 0, 0, channel.square_sum, channel.mirror, 0, nullptr};
    duties_[k] = 0;
  }
  further_.go_off(settings_.channels);
  stream_gain_q15_ = stream_step_q30_ = 0;
  has_first_ = has_signal_ = is_smooth_ = false;
  ramp_left_ = 0;
  mode_ = Mode::kOff;
  forget_deadlines();
  handover_.output.store(Output::kOff, std::memory_order_release);
}

void SamplePlayer::catch_up(uint32_t missed) {
  const uint32_t all = handover_.missed.load(std::memory_order_relaxed) + missed;
  handover_.missed.store(all, std::memory_order_relaxed);
  advance(missed);
  phase_u32_ += phase_step_u32_ * missed;
  further_.skip(missed);
  // Beyond this the gates were cut long ago (OutputWatch); the product fits.
  constexpr uint32_t kMostMetered = 0xFFFFU;
  meter_all(missed < kMostMetered ? missed : kMostMetered);
  // A ramp ends when it should, however few samples were made of it.
  const auto left = static_cast<uint32_t>(ramp_left_);
  ramp_left_ = static_cast<int32_t>(left - (missed < left ? missed : left));
  if (missed >= settings_.most_late) fade_soon(FadeCause::kLate);
}

void SamplePlayer::miss_deadline() {
  const bool is_spent = static_cast<int32_t>(on_end_ - samples_) < 0;
  forget_deadlines();
  if (is_playing()) fade(is_spent ? FadeCause::kMaxOn : FadeCause::kTouchTimeout, settings_.fade);
}

}  // namespace chladni
