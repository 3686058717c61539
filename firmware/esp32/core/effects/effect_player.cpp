#include "core/effects/effect_player.hpp"

#include "core/base/bytes.hpp"
#include "core/synthesis/waves/sine.hpp"

namespace chladni {

namespace {

namespace f = bank_format;

// Breakpoints joined by straight lines, followed sample by sample.
class Curve {
 public:
  // `at`: the first sample that is asked for.
  Curve(const uint8_t* points, uint32_t count, uint32_t at) : points_(points), count_(count) {
    uint32_t high = count;  // of those at or before `at`, the last is next_ - 1
    while (next_ < high) {
      const uint32_t middle = (next_ + high) / 2U;
      if (time(middle) <= at) {
        next_ = middle + 1U;
      } else {
        high = middle;
      }
    }
    aim();
  }

  // At a sample, none before the last one that was asked for.
  float value(uint32_t at) {
    if (at >= until_) {
      while (next_ < count_ && time(next_) <= at) ++next_;
      aim();
    }
    return before_ + slope_ * static_cast<float>(at - from_);
  }

 private:
  uint32_t time(uint32_t k) const { return read_u16(points_ + k * f::kPointBytes + f::kPointAtAt); }
  float height(uint32_t k) const {
    return static_cast<float>(read_u16(points_ + k * f::kPointBytes + f::kPointAtValue));
  }
  // Along the line to the next breakpoint; before the first and behind the last it stays.
  void aim() {
    from_ = 0;
    slope_ = 0.0F;
    until_ = 0xFFFFFFFFU;
    if (count_ == 0) return;
    before_ = height(next_ == 0 ? 0 : next_ - 1U);
    if (next_ == count_) return;
    until_ = time(next_);
    if (next_ == 0) return;
    from_ = time(next_ - 1U);
    slope_ = (height(next_) - before_) / static_cast<float>(until_ - from_);
  }

  const uint8_t* points_;
  uint32_t count_;
  uint32_t next_ = 0;
  uint32_t from_ = 0;
  uint32_t until_ = 0;
  float before_ = 0.0F;
  float slope_ = 0.0F;
};

constexpr float kOfQ15 = 1.0F / 32767.0F;

float sine(uint32_t phase_u32) {
  return static_cast<float>(sine_cosine(phase_u32).sine_q15) * kOfQ15;
}

// The same each time, -1 to 1: a sample's number, its bits mixed (Wang's hash).
float noise(uint32_t at) {
  uint32_t x = at * 0x9E3779B9U;
  x = (x ^ (x >> 16)) * 0x85EBCA6BU;
  x = (x ^ (x >> 13)) * 0xC2B2AE35U;
  x ^= x >> 16;
  return static_cast<float>(static_cast<int32_t>(x)) * (1.0F / 2147483648.0F);
}

// One and a half waves under a Hann window, which is a sine squared.
float click(const EffectPart& part, uint32_t at) {
  const uint32_t turned_u16 = at * part.rate;
  if (turned_u16 > 3U << 15) return 0.0F;
  const uint32_t phase_u32 = turned_u16 << 16;
  const float window = sine((turned_u16 << 15) / 3U << 1);
  return static_cast<float>(part.level_q15) * window * window * sine(phase_u32);
}

float clip(const EffectPart& part, uint32_t at) {
  const uint32_t turned = at * part.rate;
  const uint32_t k = turned / f::kClipSteps;
  const auto share = static_cast<float>(turned % f::kClipSteps) / static_cast<float>(f::kClipSteps);
  const auto sample = [&part](uint32_t n) {
    return n < part.amplitudes ? static_cast<float>(static_cast<int8_t>(part.data[n])) : 0.0F;
  };
  const float value = sample(k) + (sample(k + 1U) - sample(k)) * share;
  return static_cast<float>(part.level_q15) * value * (1.0F / 127.0F);
}

}  // namespace

void EffectPlayer::start(const BankEffect& effect, uint32_t level_q15, bool is_held) {
  effect_ = effect;
  is_held_ = is_held;
  level_ = static_cast<float>(level_q15) * kOfQ15;
  at_ = 0;
}

void EffectPlayer::add(float* samples, uint32_t count) {
  while (count > 0 && is_playing()) {
    const uint32_t end = is_held_ ? effect_.loop_to : effect_.lasts;
    const uint32_t left = end - at_, now = count < left ? count : left;
    add_straight(samples, now);
    at_ += now;
    samples += now;
    count -= now;
    if (at_ < end) continue;
    if (!is_held_) return stop();
    at_ = effect_.loop_from;
  }
}

void EffectPlayer::add_straight(float* samples, uint32_t count) {
  const uint8_t* at = effect_.parts;
  uint32_t tones = 0;
  for (uint32_t k = 0; k < effect_.count; ++k) {
    const EffectPart part = read_part(at);
    at = part.next();
    uint32_t& phase_u32 = phases_u32_[tones];
    if (part.kind == f::kPartTone && tones + 1U < f::kMaxTones) ++tones;
    const uint32_t end = part.begins + part.lasts;
    if (at_ >= end || at_ + count <= part.begins) continue;
    const uint32_t first = at_ < part.begins ? part.begins - at_ : 0U;
    const uint32_t last = at_ + count < end ? count : end - at_;
    if (part.kind == f::kPartTone && at_ + first == part.begins) phase_u32 = 0;
    add_part(part, at_ + first - part.begins, phase_u32, samples + first, last - first);
  }
}

void EffectPlayer::add_part(const EffectPart& part, uint32_t from, uint32_t& phase_u32,
                            float* samples, uint32_t count) const {
  Curve amplitude(part.data, part.amplitudes, from);
  Curve frequency(part.data + part.amplitudes * f::kPointBytes, part.frequencies, from);
  float rate = part.kind == f::kPartTone ? frequency.value(from) : 0.0F;
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t at = from + k;
    switch (part.kind) {
      case f::kPartTone: {
        samples[k] += level_ * amplitude.value(at) * sine(phase_u32);
        const float next = frequency.value(at + 1U);
        // As the curve is on its way, its mean over the sample counts.
        phase_u32 += static_cast<uint32_t>(0.5F * (rate + next) * 65536.0F);
        rate = next;
        break;
      }
      case f::kPartClick: samples[k] += level_ * click(part, at); break;
      case f::kPartNoise: samples[k] += level_ * amplitude.value(at) * noise(at); break;
      default: samples[k] += level_ * clip(part, at); break;
    }
  }
}

}  // namespace chladni
