// One way of making a sine's duties, chosen by macros, for bench/synthesis.py: run on this machine
// it prints the duties, on an emulated processor how many instructions a sample takes.
#include <cstdint>

#include "qemu/runtime.hpp"
#include "variant_table.hpp"  // kQuarter: 2^POINTS_BITS + 1 values of a quarter wave in Q15

uint32_t duties[5];  // seen from outside, or an idle shaper would be left out

namespace {

constexpr uint32_t kChannels = 5;
constexpr uint32_t kFractionBits = 30 - PWM_BITS;
constexpr int32_t kMask = (1 << kFractionBits) - 1;
// Duty steps times 2^(fraction bits - 15).
constexpr int32_t kGain = GAIN;
constexpr int32_t kBias = (1 << 29);

struct Channel {
  int32_t in_phase, quadrature, bias, error, older_error;
};

struct SineCosine {
  int32_t sine, cosine;
};

SineCosine look_up(uint32_t phase) {
  constexpr uint32_t kShift = 30 - POINTS_BITS;
  const uint32_t index = (phase >> kShift) & ((1U << POINTS_BITS) - 1U);
  const int16_t* const rise = &kQuarter[index];
  const int16_t* const fall = &kQuarter[(1U << POINTS_BITS) - index];
#if INTERPOLATE
  const auto fraction = static_cast<int32_t>((phase >> (kShift - 15)) & 0x7FFFU);
  const int32_t up = rise[0] + (((rise[1] - rise[0]) * fraction + 0x4000) >> 15);
  const int32_t down = fall[0] + (((fall[-1] - fall[0]) * fraction + 0x4000) >> 15);
#else
  const int32_t up = rise[0], down = fall[0];
#endif
  switch (phase >> 30) {
    case 0: return {up, down};
    case 1: return {down, -up};
    case 2: return {-up, -down};
    default: return {-down, up};
  }
}

uint32_t shape([[maybe_unused]] Channel& channel, int32_t wanted) {
#if ORDER == 2
  const int32_t fed = wanted + 2 * channel.error - channel.older_error;
  channel.older_error = channel.error;
  channel.error = fed & kMask;
#elif ORDER == 1
  const int32_t fed = wanted + channel.error;
  channel.error = fed & kMask;
#else
  const int32_t fed = wanted + (kMask + 1) / 2;
#endif
  const int32_t duty = fed >> kFractionBits;
  if (static_cast<uint32_t>(duty) >= (1U << PWM_BITS)) return duty < 0 ? 0 : (1U << PWM_BITS) - 1;
  return static_cast<uint32_t>(duty);
}

Channel channels[kChannels];
uint32_t phase = 0;

__attribute__((noinline)) void sample() {
  const SineCosine wave = look_up(phase);
  phase += STEP;
  for (uint32_t k = 0; k < kChannels; ++k) {
    Channel& channel = channels[k];
    duties[k] = shape(
        channel, channel.bias + channel.in_phase * wave.cosine - channel.quadrature * wave.sine);
  }
}

}  // namespace

int main() {
  for (Channel& channel : channels) channel = {kGain, 0, kBias, 0, 0};
#ifdef ON_THIS_MACHINE
  for (uint32_t k = 0; k < SAMPLES; ++k) {
    sample();
    const char bytes[2] = {static_cast<char>(duties[0]), static_cast<char>(duties[0] >> 8)};
    write_host(bytes, 2);
  }
#else
  const uint32_t nothing = counter();
  const uint32_t overhead = counter() - nothing;
  uint32_t most = 0;
  for (uint32_t k = 0; k < 500; ++k) {
    const uint32_t begin = counter();
    sample();
    __asm__ volatile("" ::: "memory");  // the duties count, though they are not read here
    const uint32_t count = counter() - begin - overhead;
    if (count > most) most = count;
  }
  char line[] = "most 00000000\n";
  for (int k = 0; k < 8; ++k) line[5 + k] = "0123456789abcdef"[(most >> (28 - 4 * k)) & 15];
  write_host(line, sizeof line - 1);
#endif
  return 0;
}
