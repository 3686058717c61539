// When samples are due, by the processor's cycle counter: alarms that were held up are counted, and
// one that fires twice makes no second sample.
#pragma once

#include <cstdint>

namespace chladni {

class SampleClock {
 public:
  // The first sample is due at `now`. A sample takes less than half the counter's range.
  void start(uint32_t cycles_per_sample, uint32_t now) {
    cycles_per_sample_ = cycles_per_sample;
    due_ = now;
  }

  // Whether an interrupt at `now` is to make a sample, and how many before it were never asked for.
  // Interrupt only. Always inlined: a copy of its own would lie in flash.
  [[gnu::always_inline]] bool tick(uint32_t now, uint32_t& missed) {
    uint32_t late = now - due_;
    if (static_cast<int32_t>(late) < -static_cast<int32_t>(cycles_per_sample_ / 2U)) {
      ++repeated_;
      return false;
    }
    missed = 0;
    if (static_cast<int32_t>(late) > 0) {
      for (; late >= cycles_per_sample_; late -= cycles_per_sample_) ++missed;
    }
    due_ += (missed + 1U) * cycles_per_sample_;
    return true;
  }

  // Interrupts that came a second time for one sample.
  uint32_t repeated() const { return repeated_; }

 private:
  uint32_t cycles_per_sample_ = 1;
  uint32_t due_ = 0;
  uint32_t repeated_ = 0;
};

}  // namespace chladni
