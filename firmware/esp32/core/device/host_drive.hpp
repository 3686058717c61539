// A host that drives the outputs itself: with a stream of duties, half as many frames as samples
// (duty_ring.hpp), or with waves that it repeats. If it falls silent, its drive is over.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/synthesis/synthesis.hpp"

namespace chladni {

class HostDrive {
 public:
  // It begins: a stream whose ring is to hold so many frames, or waves.
  void begin_stream(uint32_t target);
  void begin_waves() {
    mode_ = Mode::kWaves;
    is_driving_ = false;
  }
  // What coils play to each other, which a host asks for and takes the results of.
  void begin_sensing() {
    mode_ = Mode::kWaves;
    is_driving_ = true;
  }
  // The host is still there.
  void hear(Synthesis& synthesis, uint32_t now_us);
  bool is_silent(uint32_t now_us, uint32_t timeout_us) const {
    return now_us - heard_us_ >= timeout_us;
  }
  // Whether it was given the outputs, and not refused each wave that it asked for.
  bool is_driving() const { return is_driving_; }
  // It is over. Whether it had waves: then the synthesis still has their frequency and form.
  bool end();

  bool has_waves() const { return mode_ == Mode::kWaves; }
  bool play(Synthesis& synthesis, const Config& config, const Drive& drive, uint32_t ramp_us,
            uint32_t now_us);

  // The stream's next frame; false if it has not begun, or the ring is full.
  bool push(Synthesis& synthesis, const uint16_t* duties_q16, uint32_t now_us);
  // Each turn: keeps the ring at its target, and says whether enough has come to begin, or to begin
  // again. `are_outputs_free` once the interrupt no longer reads the ring.
  bool is_ready(Synthesis& synthesis, bool are_outputs_free);
  bool play_stream(Synthesis& synthesis);
  // The ring has run dry; it begins again when enough has come.
  void refill() {
    if (mode_ == Mode::kRunning) mode_ = Mode::kFilling;
  }

 private:
  enum class Mode : uint8_t {
    kNone,
    kClearing,  // frames are to come; the ring is emptied first
    kFilling,
    kRunning,
    kWaves,
  };

  Mode mode_ = Mode::kNone;
  bool is_driving_ = false;
  uint32_t heard_us_ = 0;
  uint32_t target_ = kStreamTarget;
};

}  // namespace chladni
