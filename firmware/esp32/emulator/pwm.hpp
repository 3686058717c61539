// PWM outputs as the chip's LEDC makes them, at carrier resolution, and stricter: duties written
// twice within one carrier period, which the chip may lose, are a fault here.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/synthesis/synthesis.hpp"

namespace chladni::emulator {

constexpr uint64_t kNever = UINT64_MAX;

class Pwm {
 public:
  Pwm(uint32_t channels, uint32_t bits, bool has_signs = false)
      : channels_(channels), bits_(bits), has_signs_(has_signs) {}

  // Write all duties in carrier period `period`; they are latched when the next one begins. Signs,
  // a bit for each channel, change at once. A channel that takes none now keeps its own duty, which
  // is put in place of what was written, and its sign. Returns what is wrong, or an empty string.
  std::string write(uint64_t period, int32_t* duties, uint32_t signs, uint32_t count) {
    if (count != channels_) return "duties for " + std::to_string(count) + " channels";
    if (written_ == period) {
      return "duties written twice in carrier period " + std::to_string(period);
    }
    written_ = period;
    if (signs != 0 && !has_signs_) return "a negative duty of a switch";
    for (uint32_t k = 0; k < count; ++k) {
      if (duties[k] < 0 || duties[k] >= (1 << bits_)) {
        return "duty " + std::to_string(duties[k]) + " overflows the timer";
      }
      if (((deaf_ >> k) & 1U) != 0) {
        duties[k] = std::abs(next_[k]);
        continue;
      }
      const uint32_t sign = (signs >> k) & 1U;
      // The pulse that is on would drive the other way.
      if (sign != ((signs_ >> k) & 1U) && std::abs(latched_[k]) > 3 << (bits_ - 3)) {
        return "the sign of channel " + std::to_string(k) + " changes within a pulse";
      }
      signs_ = (signs_ & ~(1U << k)) | sign << k;
      next_[k] = sign != 0 ? -duties[k] : duties[k];
    }
    deaf_ = 0;
    return {};
  }
  // Those channels, a bit each, do not take the next duty.
  void make_deaf(uint32_t channels) { deaf_ = channels; }

  // One carrier period begins: latch, and record what the pins will do.
  void begin_period() {
    if (is_cut_) next_.fill(0);
    latched_ = next_;
    record_.insert(record_.end(), latched_.begin(), latched_.begin() + channels_);
  }

  // Latched duties since the last call, channel by channel within each carrier period.
  std::vector<int16_t> take_record() {
    std::vector<int16_t> taken;
    taken.swap(record_);
    return taken;
  }

  // Every output low, as a reset leaves them.
  void reset() {
    next_.fill(0);
    signs_ = 0;
    written_ = kNever;
    is_cut_ = false;
  }

  // Gates are taken from the timer and held low, whatever is written, until a reset. They go low
  // at once on the chip, and here with the next carrier period.
  void cut() { is_cut_ = true; }

  // What a channel's pins do in this carrier period, in steps.
  int32_t latched(uint32_t channel) const { return latched_[channel]; }
  uint32_t channels() const { return channels_; }
  uint32_t bits() const { return bits_; }
  bool has_signs() const { return has_signs_; }

 private:
  uint32_t channels_;
  uint32_t bits_;
  bool has_signs_;
  std::array<int32_t, kMaxChannels> next_{};
  std::array<int32_t, kMaxChannels> latched_{};
  uint32_t signs_ = 0;
  uint64_t written_ = kNever;
  bool is_cut_ = false;
  uint32_t deaf_ = 0;
  std::vector<int16_t> record_;
};

}  // namespace chladni::emulator
