#include "core/synthesis/rings/duty_ring.hpp"

namespace chladni {

namespace {

// What 1/256 frame of error adds to the rate, in 2^-32 frames per sample: a frame changes it by
// 61 ppm, which brings the ring back with a time constant of 1.7 s.
constexpr int32_t kPushPerQ8 = 512;
// And what it adds each millisecond for good, in 1/256: the ring returns without a swing (damping
// 0.9 at 78 kHz).
constexpr int32_t kLearnPerQ8 = 24;
// The largest correction, 1000 ppm: crystals are within 100.
constexpr int32_t kMostDrift = 2147484;
// The fill is averaged over 256 ms: frames come in packets, and must not be heard as a wobble.
constexpr int32_t kMeanShift = 8;

int32_t clamp_to(int32_t value, int32_t most) {
  return value < -most ? -most : (value > most ? most : value);
}

}  // namespace

void DutyRing::start(uint32_t channels, const uint16_t* full_current_ma, bool is_signed) {
  channels_ = channels;
  sign_bit_ = is_signed ? 0x8000 : 0;
  full_current_ma_ = full_current_ma;
  clear();
}

void DutyRing::clear() {
  head_.store(0, std::memory_order_relaxed);
  tail_.store(0, std::memory_order_relaxed);
  rate_.store(kHalf, std::memory_order_relaxed);
  between_u32_ = 0;
  mean_fill_q8_ = static_cast<int32_t>(target_ << 8);
  drift_sum_ = 0;
  metered_ = 0;
  ahead_ma_ = 0;
  crest_ma_ = 0;
}

bool DutyRing::push(const uint16_t* duties_q16) {
  const uint32_t head = head_.load(std::memory_order_relaxed);
  // A frame that was played keeps its place until it was metered too.
  if (ahead() >= kStreamFrames) return false;
  Frame& frame = frames_[head % kStreamFrames];
  for (uint32_t k = 0; k < channels_; ++k) frame[k] = duties_q16[k];
  const uint32_t current_ma = frame_ma(duties_q16);
  // Sixteen of the largest that a configuration may have fit.
  currents_ma_[head % kStreamFrames] = static_cast<uint16_t>(current_ma);
  ahead_ma_ += current_ma;
  if (current_ma > crest_ma_) crest_ma_ = current_ma;
  head_.store(head + 1U, std::memory_order_release);
  return true;
}

void DutyRing::forget_played() {
  for (const uint32_t played = tail(); metered_ != played; ++metered_) {
    ahead_ma_ -= currents_ma_[metered_ % kStreamFrames];
  }
}

uint32_t DutyRing::frame_ma(const uint16_t* duties_q16) const {
  uint32_t sum_q12 = 0;
  for (uint32_t k = 0; k < channels_; ++k) {
    const int32_t value = value_of(duties_q16[k]);
    const uint32_t size = static_cast<uint32_t>(value < 0 ? -value : value);
    // A signed duty has a bit less.
    sum_q12 += (size * size >> (sign_bit_ == 0 ? 16U : 14U)) * full_current_ma_[k] >> 4;
  }
  return (sum_q12 + 4095U) >> 12;
}

void DutyRing::steer() {
  const auto fill_q8 = static_cast<int32_t>(filled() << 8);
  mean_fill_q8_ += (fill_q8 - mean_fill_q8_) >> kMeanShift;
  const int32_t error_q8 = mean_fill_q8_ - static_cast<int32_t>(target_ << 8);
  const int32_t wanted = error_q8 * kPushPerQ8 + drift_sum_;
  const int32_t drift = clamp_to(wanted, kMostDrift);
  // What is learned while more is wanted than allowed would have to be unlearned.
  if (drift == wanted) drift_sum_ += error_q8 * kLearnPerQ8 / 256;
  rate_.store(kHalf + static_cast<uint32_t>(drift), std::memory_order_relaxed);
}

bool DutyRing::next(int32_t* duties_q15) {
  const uint32_t tail = tail_.load(std::memory_order_relaxed);
  const uint32_t held = head_.load(std::memory_order_acquire) - tail;
  const Frame& low = frames_[tail % kStreamFrames];
  const Frame& high = held < 2 ? low : frames_[(tail + 1U) % kStreamFrames];
  const auto share_q15 = static_cast<int32_t>(between_u32_ >> 17);
  const int32_t unsigned_shift = sign_bit_ == 0 ? 1 : 0;
  for (uint32_t k = 0; k < channels_; ++k) {
    const int32_t from = value_of(low[k]);
    // A difference of 17 bits with its sign, times 15, fits once a bit is dropped.
    const int32_t step = (value_of(high[k]) - from) >> 1;
    duties_q15[k] = (from + ((step * share_q15) >> 14)) >> unsigned_shift;
  }
  if (held < 2) return false;
  const uint32_t next = between_u32_ + rate_u32();
  if (next < between_u32_) tail_.store(tail + 1U, std::memory_order_release);
  between_u32_ = next;
  return true;
}

}  // namespace chladni
