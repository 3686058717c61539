// One to five voices on all channels, then the last of five a signal instead of a tone: what a
// sample of each takes.
#pragma once

#include <cstdint>

#include "core/base/crc32.hpp"
#include "core/synthesis/synthesis.hpp"
#include "qemu/runtime.hpp"

namespace chladni::qemu {

class VoicesScenario {
 public:
  void run(uint32_t overhead) {
    hal_.context = this;
    hal_.set_duties = [](void* context, int32_t* duties, uint32_t) {
      static_cast<VoicesScenario*>(context)->duties_ = duties;
    };
    SynthesisSettings settings{};
    settings.channels = CHANNELS;
    settings.pwm_bits = 10;
    settings.frequency_millihertz = 160000;
    settings.ramp_us = 4000;
    settings.touch_timeout_us = 100000;
    settings.max_on_us = 10000000;
    synthesis_.start(hal_, settings);
    for (uint32_t part = 0; part < kParts; ++part) {
      const uint32_t count = part < kMaxVoices ? part + 1U : kMaxVoices;
      Voices voices{};
      for (uint32_t v = 0; v < count; ++v) {
        for (uint32_t k = 0; k < CHANNELS; ++k) {
          voices[v].drive[k] = {static_cast<int16_t>(3000 + 700 * v),
                                static_cast<int16_t>(900 * k)};
        }
        voices[v].level_q15 = 32767;
        voices[v].starts = v + 1U == count;
        voices[v].frequency_millihertz = 160000U + 7000U * v;
      }
      voices[kMaxVoices - 1U].has_signal = part == kMaxVoices;
      synthesis_.play_voices(voices, {0, 4000, count == 1});
      for (uint32_t sample = 0; sample < kSamples; ++sample) {
        synthesis_.signal(kMaxVoices - 1U).push(static_cast<int16_t>(100 * sample));
        const uint32_t begin = counter();
        synthesis_.player().sample(0);
        const uint32_t taken = counter() - begin - overhead;
        uint32_t& most = sample == 0 ? with_news : (sample < kRamp ? ramping : steady[part]);
        if (taken > most) most = taken;
        for (uint32_t k = 0; k < CHANNELS; ++k) {
          const uint8_t bytes[2] = {static_cast<uint8_t>(duties_[k]),
                                    static_cast<uint8_t>(duties_[k] >> 8)};
          crc_ = crc32_feed(crc_, bytes, sizeof bytes);
        }
      }
    }
  }

  uint32_t crc() const { return crc_ ^ 0xFFFFFFFFU; }

  static constexpr uint32_t kParts = kMaxVoices + 1U;

  // The most of samples in each part; in any, while voices ramp or a command is taken.
  uint32_t steady[kParts] = {};
  uint32_t ramping = 0;
  uint32_t with_news = 0;

 private:
  static constexpr uint32_t kSamples = 200, kRamp = 90;

  Hal hal_{};
  Synthesis synthesis_{};
  const int32_t* duties_ = nullptr;
  uint32_t crc_ = kCrc32Start;
};

}  // namespace chladni::qemu
