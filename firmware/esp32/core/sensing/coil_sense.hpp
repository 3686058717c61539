// What coils read of each other: one plays a sine, the others are open and listened to in turn.
//
// Where the first coil plays, a known share of its own voltage is read as the last: what all
// filters and the converter make of a duty. The converter runs in step with the carrier, and on
// from one request to the next, so that this holds for a whole session.
//
// Or one plays, and an accelerometer on the plate is read: no other coil is listened to then, and
// neither converter nor expander is needed.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/generated/device_codes.hpp"
#include "core/hal.hpp"
#include "core/sensing/accelerometer.hpp"
#include "core/sensing/lock_in.hpp"
#include "core/synthesis/synthesis.hpp"

namespace chladni {

struct SenseRequest {
  uint32_t playing;    // channel
  uint32_t multiple;   // of 40 Hz, even (docs/link-protocol.md)
  uint32_t level_q15;  // 32767 for full amplitude
  uint32_t settle_ms;  // before the first coil is listened to
  uint32_t readings;   // of kSensePairs pairs of conversions, for each coil
  uint32_t motions;    // samples of the accelerometer in their place; 0: coils are listened to
};

// What one coil read.
struct CoilReading {
  uint8_t coil;
  int32_t in_phase_q5;
  int32_t quadrature_q5;
  int32_t sum;
  uint32_t squares_by_256;
};

class CoilSense {
 public:
  void start(const Config& config, uint32_t now_ms);
  bool is_wired() const { return is_wired_; }
  // Whether there is a bus for an accelerometer.
  bool has_bus() const { return has_bus_; }
  SenseState state() const { return state_; }
  bool is_running() const { return state_ == SenseState::kRunning; }

  // What was read before is forgotten. Of a request in range, while none runs.
  void ask(const SenseRequest& request, uint32_t now_ms);
  // Whether outputs are to play the coil now; and what came of it.
  bool wants_play() const { return is_running() && stage_ == Stage::kToPlay; }
  const SenseRequest& request() const { return request_; }
  uint32_t frequency_millihertz() const;
  // Of a sample.
  uint32_t phase_step_u32() const { return step_u32_ << sample_bits_; }
  void note_play(uint32_t amplitude_q16);
  // Each turn of the main loop, whether one runs or not.
  void turn(const Hal& hal, const Synthesis& synthesis, uint32_t now_ms);
  // It ends, or is ended, if one runs.
  void end(const Hal& hal, SenseState state);

  // Whether it was to be told, and did not answer, for the first time since start.
  bool take_missing() {
    const bool is_new = is_missing_ && !was_told_;
    was_told_ = was_told_ || is_missing_;
    return is_new;
  }

  uint32_t session() const { return session_; }
  uint32_t amplitude_q16() const { return amplitude_q16_; }
  uint32_t count() const { return count_; }
  const CoilReading& at(uint32_t k) const { return readings_[k]; }
  const Accelerometer& accelerometer() const { return accelerometer_; }

 private:
  enum class Stage : uint8_t { kToFind, kToPlay, kToBegin, kToSelect, kListening };

  void turn_motion(const Hal& hal, const Synthesis& synthesis);
  bool listen(const Hal& hal, const Synthesis& synthesis);
  void stop_listening(const Hal& hal);
  void read(const Hal& hal, const Synthesis& synthesis);
  void lose(const Hal& hal);
  void take_pair(int32_t pair, uint32_t now);
  void take(uint16_t value);
  void select_next(const Hal& hal, const Synthesis& synthesis);
  void wake_all(const Hal& hal, uint32_t now_ms);

  bool is_wired_ = false;
  bool has_bus_ = false;
  bool has_bridges_ = false;
  uint32_t channels_ = 0;
  uint32_t sample_bits_ = 1;  // a sample of the outputs has so many pairs, as a power of two
  SenseState state_ = SenseState::kNone;
  Stage stage_ = Stage::kToPlay;
  SenseRequest request_{};
  uint32_t step_u32_ = 0;  // of a pair of conversions
  uint32_t asked_ms_ = 0;
  uint32_t amplitude_q16_ = 0;

  // The converter.
  bool is_listening_ = false;
  uint32_t session_ = 0;
  uint32_t begun_at_ = 0;  // the sample when it was started
  uint32_t values_ = 0;    // since then
  int32_t first_of_pair_ = 0;
  bool is_too_loud_ = false;
  bool are_awake_ = false;
  bool is_missing_ = false;  // the expander
  bool was_told_ = false;
  uint32_t woken_ms_ = 0;

  uint32_t phase_from_ = 0;  // the pair with which the coil began, whose phase is 0
  uint32_t from_ = 0;        // the pair with which listening begins
  uint32_t coil_ = 0;
  bool has_reference_ = false;
  LockIn found_;
  Accelerometer accelerometer_;
  uint32_t count_ = 0;                                // coils that were listened to
  std::array<CoilReading, kMaxChannels> readings_{};  // a playing coil's place is the reference's
};

}  // namespace chladni
