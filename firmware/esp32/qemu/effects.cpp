// Effects on another processor: what a sample of each takes in instructions, and what comes out,
// for tools/effect_instructions.py.
#include <array>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/effects/effect_player.hpp"
#include "core/effects/low_pass.hpp"
#include "qemu/runtime.hpp"

namespace {

namespace f = chladni::bank_format;

constexpr uint32_t kLasts = 600, kAtOnce = 12;

struct Made {
  std::array<uint8_t, 128> bytes{};
  uint32_t count = 0;

  void put(uint32_t value, uint32_t size) {
    chladni::put_word(&bytes[count], value, size);
    count += size;
  }
  void part(uint32_t kind, uint32_t amplitudes, uint32_t frequencies, uint32_t level,
            uint32_t rate) {
    put(kind, 2);
    put(0, 2);
    put(kLasts, 2);
    put(amplitudes, 2);
    put(frequencies, 2);
    put(level, 2);
    put(rate, 2);
  }
  void point(uint32_t at, uint32_t value) {
    put(at, 2);
    put(value, 2);
  }
};

// Of one part, and the low-pass behind it.
void play(const char* name, const Made& made, uint32_t overhead) {
  chladni::EffectPlayer player;
  chladni::LowPass low_pass;
  player.start({made.bytes.data(), 1, kLasts, 0, kLasts}, 32767, false);
  uint32_t taken = 0;
  for (uint32_t at = 0; at < kLasts; at += kAtOnce) {
    std::array<float, kAtOnce> samples{};
    const uint32_t begin = counter();
    player.add(samples.data(), kAtOnce);
    for (float& one : samples) one = low_pass.next(one);
    taken += counter() - begin - overhead;
    if (at != kLasts / 2U) continue;
    for (const float one : samples) {
      say("sample", static_cast<uint32_t>(static_cast<int32_t>(one) + 65536));
    }
  }
  say(name, taken / kLasts);
}

}  // namespace

int main() {
  const uint32_t nothing = counter();
  const uint32_t overhead = counter() - nothing;
  Made tone, click, noise, clip;
  tone.part(f::kPartTone, 3, 2, 0, 0);
  tone.point(0, 0);
  tone.point(200, 32767);
  tone.point(kLasts, 3000);
  tone.point(0, 2000);
  tone.point(kLasts, 6000);
  play("tone", tone, overhead);
  click.part(f::kPartClick, 0, 0, 32767, 160);
  play("click", click, overhead);
  noise.part(f::kPartNoise, 1, 0, 0, 0);
  noise.point(0, 20000);
  play("noise", noise, overhead);
  clip.part(f::kPartClip, 64, 0, 32767, 400);
  for (uint32_t k = 0; k < 64; ++k) clip.put((k * 37U) & 0xFFU, 1);
  play("clip", clip, overhead);
  return 0;
}
