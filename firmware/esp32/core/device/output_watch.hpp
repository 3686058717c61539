// What the sample interrupt does to the outputs by itself, and whether it still comes.
#pragma once

#include <cstdint>

#include "core/synthesis/synthesis.hpp"

namespace chladni {

class OutputWatch {
 public:
  void start(uint32_t now_us) {
    *this = OutputWatch{};
    samples_us_ = now_us;
  }
  // Something new plays: what ended the last is forgotten, so that the same again is news.
  void expect_play() { fade_ = FadeCause::kNone; }
  // Why outputs fade, if that is news; else kNone.
  FadeCause fade(const Synthesis& synthesis);
  // How long no sample has come, once that is too long; else 0.
  uint32_t stopped_us(const Synthesis& synthesis, uint32_t now_us);

 private:
  FadeCause fade_ = FadeCause::kNone;
  // How far the interrupt was when last looked at, and since when it stands there.
  uint32_t samples_ = 0;
  uint32_t samples_us_ = 0;
};

}  // namespace chladni
