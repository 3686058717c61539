// Drives of several fingers become one command: each voice's gains, and one bias for their sum.
//
// No one knows how the phases of voices will stand to each other, so a channel is reckoned to get
// the sum of their amplitudes. That bounds the peak, and also the mean square over any window:
// by Minkowski's inequality its root is at most the sum of the voices' own roots, so that one sine
// of the summed amplitude and the slowest voice's period takes as much or more.
#include "core/generated/table_format.hpp"
#include "core/synthesis/synthesis.hpp"

namespace chladni {

namespace {

uint32_t allowed(uint32_t frequency_millihertz) {
  namespace f = table_format;
  const uint32_t most = f::kMaxFrequencyMillihertz, least = f::kMinFrequencyMillihertz;
  if (frequency_millihertz > most) return most;
  return frequency_millihertz < least ? least : frequency_millihertz;
}

const Voice& first_of(const Voices& voices) {
  for (const Voice& voice : voices) {
    if (voice.level_q15 > 0) return voice;
  }
  return voices[0];
}

}  // namespace

// What begins counts with what it takes the place of, which is still on its way out.
void Synthesis::let_sound(uint32_t voices) {
  uint32_t& sounding = handover().command.voices;
  period_q12_ = 0;
  for (uint32_t v = 0; v < kMaxVoices; ++v) {
    if (((voices | sounding) >> v & 1U) == 0) continue;
    if (periods_q12_[v] > period_q12_) period_q12_ = periods_q12_[v];
  }
  sounding = voices;
}

Synthesis::Sizes Synthesis::sizes_of(const Voices& voices, const Levels& levels_q15) const {
  Sizes sums{};
  for (uint32_t v = 0; v < kMaxVoices; ++v) {
    if (levels_q15[v] == 0) continue;
    for (uint32_t k = 0; k < settings_.channels; ++k) {
      sums[k] += share_q15(size_of(voices[v].drive[k]), levels_q15[v]);
    }
  }
  return sums;
}

// Lowers all levels until no channel is asked for more than full scale; then what limits leave of
// them.
uint32_t Synthesis::fit_voices(const Voices& voices, Levels& levels_q15, Sizes& sizes) {
  sizes = sizes_of(voices, levels_q15);
  uint32_t largest = 0;
  for (const uint32_t size : sizes) largest = size > largest ? size : largest;
  constexpr auto kFull = static_cast<uint32_t>(kOneQ15);
  if (largest > kFull) {
    ++limited_;
    for (uint32_t& level : levels_q15) level = share_of(level, kFull, largest);
    sizes = sizes_of(voices, levels_q15);
  }
  return fitting_level(sizes, kFull, Waveform::kSine);
}

// The frequencies of those that begin. One that takes another's place counts as the slower of both
// until it falls silent itself.
void Synthesis::begin_voices(const Voices& voices, Command& command) {
  for (uint32_t v = 0; v < kMaxVoices; ++v) {
    if (!voices[v].starts) continue;
    const uint32_t bit = 1U << v;
    command.signals = (command.signals & ~bit) | (voices[v].has_signal ? bit : 0U);
    // A signal may stay at its crest: as a wave whose period no window takes in.
    const uint32_t asked = voices[v].has_signal ? 0U : voices[v].frequency_millihertz;
    const uint32_t millihertz = allowed(asked);
    const uint32_t step = phase_step_u32(millihertz, settings_.pwm_bits);
    (v == 0 ? command.phase_step_u32 : command.further[v - 1U].phase_step_u32) = step;
    const uint32_t period = period_share_q12(millihertz);
    const bool was_silent = (command.voices >> v & 1U) == 0;
    if (was_silent || period > periods_q12_[v]) periods_q12_[v] = period;
  }
}

bool Synthesis::play_voices(const Voices& voices, const PlayOptions& options) {
  if (has_command()) return false;
  const Waveform waveform = options.starts_touch ? next_waveform_ : handover().command.waveform;
  if (waveform != Waveform::kSine) {
    const Voice& first = first_of(voices);
    return play(first.drive, {first.level_q15, options.ramp_us, options.starts_touch});
  }
  Command& command = next_command(Command::Kind::kDrive, options.starts_touch, options.ramp_us);
  command.is_smooth = options.is_smooth;
  command.waveform = waveform;
  begin_voices(voices, command);
  Levels levels{};
  uint32_t sounding = 0;
  int32_t count = 0;
  for (uint32_t v = 0; v < kMaxVoices; ++v) {
    levels[v] = voices[v].level_q15 > 32767U ? 32767U : voices[v].level_q15;
    if (levels[v] == 0) continue;
    sounding |= 1U << v;
    ++count;
  }
  let_sound(sounding);
  Sizes sizes{};
  const uint32_t common = fit_voices(voices, levels, sizes);
  for (uint32_t v = 0; v < kMaxVoices; ++v) {
    const auto level = static_cast<int32_t>(share_q15(levels[v], common));
    if (v == 0) {
      set_gains(voices[v].drive, level, command.first.data(), command.second.data());
    } else if (levels[v] > 0) {
      FurtherGains& gains = command.further[v - 1U];
      set_gains(voices[v].drive, level, gains.in_phase.data(), gains.quadrature.data());
    }
  }
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    // Each voice's gains were rounded.
    const auto size = static_cast<int32_t>(share_q15(sizes[k], common));
    command.bias[k] = sizes[k] > 0 && common > 0 ? bias_of(size + count) : 0;
  }
  post();
  return true;
}

void Synthesis::set_gains(const Drive& drive, int32_t level_q15, int32_t* in_phase,
                          int32_t* quadrature) const {
  const int32_t scale = gain_scale();
  for (uint32_t k = 0; k < settings_.channels; ++k) {
    in_phase[k] = ((drive[k].in_phase_q15 * level_q15) >> 15) * scale;
    quadrature[k] = ((drive[k].quadrature_q15 * level_q15) >> 15) * scale;
  }
}

}  // namespace chladni
