// Frames of duties from a host, at half the sample rate, played at the device's own clock.
//
// A ring between the main loop, which pushes, and the sample interrupt, which reads. The host's
// clock differs from ours: reading goes a little faster when the ring fills and slower when it
// empties, so that it stays half full. An empty ring is an underrun: the synthesis fades out.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/generated/table_format.hpp"

namespace chladni {

constexpr uint32_t kStreamFrames = 512;  // 52 ms at 10 bits
// Filled so far before playing begins, and where `steer` keeps it, unless the host asks for
// another.
constexpr uint32_t kStreamTarget = 96;

class DutyRing {
 public:
  // `full_current_ma` of each channel stays where it is. With bridges a frame's duties are signed.
  void start(uint32_t channels, const uint16_t* full_current_ma, bool is_signed);

  // Main loop: append a frame of duties (65536 would be 1; of signed ones 32768). False if the ring
  // is full.
  bool push(const uint16_t* duties_q16);
  // Main loop: frames that were not metered yet, and what the supply is to deliver to them, mA
  // times frames; and to one more.
  uint32_t ahead() const { return head_.load(std::memory_order_relaxed) - metered_; }
  uint32_t ahead_ma() const { return ahead_ma_; }
  uint32_t frame_ma(const uint16_t* duties_q16) const;
  // The most of any frame since `clear`.
  uint32_t crest_ma() const { return crest_ma_; }
  // Main loop, before the meter is read: what was played until now is in it.
  void forget_played();
  // Main loop, every millisecond: keep the ring filled to its target.
  void steer();
  uint32_t filled() const { return head_.load(std::memory_order_acquire) - tail(); }
  // Frames per sample less one half, in 2^-32: what the host's clock is off by.
  int32_t drift() const { return static_cast<int32_t>(rate_u32() - kHalf); }
  bool is_ready() const { return filled() >= target_; }
  // Frames to hold from the next `clear` on: few are heard soon, many outlast a host that is late.
  void aim(uint32_t target) { target_ = target; }
  // Forget everything; only while the interrupt does not read.
  void clear();

  // Interrupt: interpolated duties of this sample, 15 bits. False if the ring is empty; then they
  // hold.
  bool next(int32_t* duties_q15);

 private:
  static constexpr uint32_t kHalf = 0x80000000U;
  using Frame = std::array<uint16_t, table_format::kMaxActuators>;

  int32_t value_of(uint16_t word) const {
    return (static_cast<int32_t>(word) ^ sign_bit_) - sign_bit_;
  }
  uint32_t tail() const { return tail_.load(std::memory_order_acquire); }
  uint32_t rate_u32() const { return rate_.load(std::memory_order_relaxed); }

  uint32_t channels_ = 0;
  int32_t sign_bit_ = 0;  // of a frame's word, if it has one
  const uint16_t* full_current_ma_ = nullptr;
  uint32_t target_ = kStreamTarget;
  std::array<Frame, kStreamFrames> frames_{};
  std::atomic<uint32_t> head_{0};  // frames pushed; written by the main loop
  std::atomic<uint32_t> tail_{0};  // frames left behind; written by the interrupt
  std::atomic<uint32_t> rate_{kHalf};
  uint32_t between_u32_ = 0;  // from the frame at the tail to the one after it; interrupt only
  // What each frame takes from the supply; of those from `metered_` on, the sum.
  std::array<uint16_t, kStreamFrames> currents_ma_{};
  uint32_t metered_ = 0;
  uint32_t ahead_ma_ = 0;
  uint32_t crest_ma_ = 0;
  int32_t mean_fill_q8_ = 0;
  int32_t drift_sum_ = 0;
};

}  // namespace chladni
