// A finger's signal that is no tone: samples at 80 MHz / 2^15 = 2441 Hz whatever the carrier,
// joined by straight lines.
//
// A ring between the main loop, which pushes, and the sample interrupt, which reads. One that has
// run dry dies away, and goes on with what comes.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace chladni {

// From one to the next there are 2^(13 - carrier's bits) samples of the interrupt's.
constexpr uint32_t kSignalShift = 13;
constexpr uint32_t kSignalSamples = 128;  // 52 ms

class SignalRing {
 public:
  // Main loop: what waits is dropped. The interrupt may have gone one further meanwhile, which
  // costs the first sample that is pushed.
  void begin() { head_.store(tail_.load(std::memory_order_acquire), std::memory_order_release); }
  // Main loop: -32767 to 32767. False if the ring is full.
  bool push(int16_t sample_q15) {
    const uint32_t head = head_.load(std::memory_order_relaxed);
    if (filled() >= kSignalSamples) return false;
    samples_[head % kSignalSamples] = sample_q15;
    head_.store(head + 1U, std::memory_order_release);
    return true;
  }
  uint32_t filled() const {
    const uint32_t head = head_.load(std::memory_order_acquire);
    const auto left = static_cast<int32_t>(head - tail_.load(std::memory_order_acquire));
    return left > 0 ? static_cast<uint32_t>(left) : 0U;
  }

  // Interrupt: from rest.
  [[gnu::always_inline]] void start() {
    value_ = step_ = 0;
    left_ = 0;
  }
  // Interrupt: this sample's value, 15 bits. `shift`: 2^shift of them from one pushed to the next.
  [[gnu::always_inline]] int32_t next(uint32_t shift) {
    if (left_ == 0) {
      aim(shift);
      left_ = 1U << shift;
    }
    --left_;
    value_ += step_;
    return value_ >> shift;
  }

 private:
  [[gnu::always_inline]] void aim(uint32_t shift) {
    const int32_t now = value_ >> shift;
    const uint32_t tail = tail_.load(std::memory_order_relaxed);
    const auto waiting = static_cast<int32_t>(head_.load(std::memory_order_acquire) - tail);
    if (waiting > 0) {
      step_ = samples_[tail % kSignalSamples] - now;
      tail_.store(tail + 1U, std::memory_order_release);
    } else {
      // An eighth of what is left, and the last of it at once.
      step_ = -(now >= -7 && now <= 7 ? now : now / 8);
    }
  }

  std::array<int16_t, kSignalSamples> samples_{};
  std::atomic<uint32_t> head_{0};  // written by the main loop
  std::atomic<uint32_t> tail_{0};  // written by the interrupt
  // The interrupt's own: where it is, times 2^shift.
  int32_t value_ = 0;
  int32_t step_ = 0;
  uint32_t left_ = 0;
};

}  // namespace chladni
