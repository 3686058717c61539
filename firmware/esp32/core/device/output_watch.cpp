#include "core/device/output_watch.hpp"

namespace chladni {

namespace {

// Eighty samples at the fastest carrier: nothing that masks an interrupt takes so long. The last
// sample is seen within a turn of a millisecond, and the time is found to be over within another.
constexpr uint32_t kStoppedUs = 4000;

}  // namespace

FadeCause OutputWatch::fade(const Synthesis& synthesis) {
  const FadeCause cause = synthesis.fade_cause();
  if (cause == fade_) return FadeCause::kNone;
  fade_ = cause;
  return cause;
}

uint32_t OutputWatch::stopped_us(const Synthesis& synthesis, uint32_t now_us) {
  const uint32_t samples = synthesis.samples();
  if (samples != samples_) {
    samples_ = samples;
    samples_us_ = now_us;
    return 0;
  }
  const uint32_t stopped_us = now_us - samples_us_;
  return stopped_us < kStoppedUs ? 0U : stopped_us;
}

}  // namespace chladni
