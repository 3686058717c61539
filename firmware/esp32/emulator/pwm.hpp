// PWM outputs as the chip's LEDC makes them, at carrier resolution, and stricter: a duty written
// twice within one carrier period, which the chip may lose, is a fault here.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/synthesis.hpp"

namespace chladni::emulator {

constexpr uint64_t kNever = UINT64_MAX;

class Pwm {
 public:
  Pwm(uint32_t channels, uint32_t bits) : channels_(channels), bits_(bits) {}

  // Write a duty in carrier period `period`; it is latched when the next one begins.
  // Returns what is wrong, or an empty string.
  std::string write(uint64_t period, uint32_t channel, uint32_t duty) {
    if (channel >= channels_) return "duty written to channel " + std::to_string(channel);
    if (duty >= (1U << bits_)) return "duty " + std::to_string(duty) + " overflows the timer";
    if (written_[channel] == period) {
      return "duty of channel " + std::to_string(channel) + " written twice in carrier period " +
             std::to_string(period);
    }
    written_[channel] = period;
    next_[channel] = duty;
    return {};
  }

  // One carrier period begins: latch, and record what the pins will do.
  void begin_period() {
    for (uint32_t k = 0; k < channels_; ++k) {
      latched_[k] = next_[k];
      record_.push_back(static_cast<uint16_t>(latched_[k]));
    }
  }

  // Latched duties since the last call, channel by channel within each carrier period.
  std::vector<uint16_t> take_record() {
    std::vector<uint16_t> taken;
    taken.swap(record_);
    return taken;
  }

  // Power on: every output low.
  void reset() {
    next_.fill(0);
    latched_.fill(0);
    written_.fill(kNever);
  }

  uint32_t channels() const { return channels_; }
  uint32_t bits() const { return bits_; }

 private:
  uint32_t channels_;
  uint32_t bits_;
  std::array<uint32_t, kMaxChannels> next_{};
  std::array<uint32_t, kMaxChannels> latched_{};
  std::array<uint64_t, kMaxChannels> written_ = filled(kNever);
  std::vector<uint16_t> record_;

  static std::array<uint64_t, kMaxChannels> filled(uint64_t value) {
    std::array<uint64_t, kMaxChannels> result{};
    result.fill(value);
    return result;
  }
};

}  // namespace chladni::emulator
