// An effect as it plays: its parts added up, sample by sample, in the main loop.
#pragma once

#include <array>
#include <cstdint>

#include "core/effects/bank.hpp"

namespace chladni {

class EffectPlayer {
 public:
  // From its begin; one that is held goes round its loop until `stop`.
  void start(const BankEffect& effect, uint32_t level_q15, bool is_held);
  void stop() { effect_.count = 0; }
  bool is_playing() const { return effect_.count > 0; }
  bool is_held() const { return is_playing() && is_held_; }

  // Its next samples are added to those that are there; 32767 is as loud as a place allows.
  void add(float* samples, uint32_t count);

 private:
  void add_straight(float* samples, uint32_t count);
  // `from`: samples from the part's begin.
  void add_part(const EffectPart& part, uint32_t from, uint32_t& phase_u32, float* samples,
                uint32_t count) const;

  BankEffect effect_{};
  bool is_held_ = false;
  float level_ = 0.0F;
  uint32_t at_ = 0;  // samples from its begin
  std::array<uint32_t, bank_format::kMaxTones> phases_u32_{};
};

}  // namespace chladni
