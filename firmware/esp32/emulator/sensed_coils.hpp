// Coils that hear each other through a plate: the port expander and multiplexer that choose one,
// the amplifier, and the converter that reads it.
//
// What a coil's duty makes another read is an impulse response, in the converter's steps: of duties
// at 80 MHz / 4096, for each of the four conversions between two of them. Python has it from the
// plate (host/emulation/sensed_plate.py).
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <deque>
#include <vector>

#include "core/hal.hpp"
#include "emulator/noise.hpp"
#include "emulator/pwm.hpp"

namespace chladni::emulator {

// Of the slowest carrier, 19.5 kHz, up to the rate of conversions, of which they take whole
// multiples for standing still.
constexpr uint32_t kHarmonics = 4;

struct SensingFaults {
  bool is_expander_absent = false;
  bool is_converter_dead = false;
  bool is_pin_open = false;    // it reads the middle of its range, and noise
  uint32_t stuck_address = 0;  // bits of the multiplexer's address that are always 1
  uint32_t lost_values = 0;    // so many of the next never come, and no one says so
};

// A blow on the desk, which the plate answers by ringing: what every coil that is heard has of it.
struct Bump {
  double steps = 0.0;    // of the converter, at first
  double hz = 0.0;       // of the ringing
  double decay_s = 1.0;  // until 1/e is left
  uint64_t from = 0;     // clocks of 80 MHz since the first carrier period
};

class SensedCoils {
 public:
  // Responses of (channels that are heard and the reference, channels that play, conversions,
  // duties), the newest duty's first.
  // What of a carrier of that many harmonics a conversion sees at its moment, steps, (heard and
  // reference, playing, harmonics), and how many duties late.
  // The converter's noise and bend, RMS and most, in steps, and how late it starts, us.
  void set_responses(uint32_t channels, std::vector<float> responses,
                     std::vector<std::complex<double>> carrier, uint32_t late, double noise,
                     double bend, double begin_us, uint32_t seed);
  SensingFaults& faults() { return faults_; }
  void set_bump(const Bump& bump) { bump_ = bump; }
  // The expander's first five outputs: the multiplexer's input, or the reference in its place.
  uint32_t listens_at() const { return registers_[2] & 31U; }
  // The expander's second eight outputs, a bit each: which bridges are awake.
  uint32_t awake() const { return registers_[3]; }

  // The expander's registers; nothing is read of it.
  BusStatus transfer(const uint8_t* written, uint32_t count);
  bool start(uint64_t period, const Pwm& pwm);
  void stop();
  uint32_t heard(uint16_t* values, uint32_t most);
  // Once the duties of this carrier period are on the pins.
  void begin_period(uint64_t period, const Pwm& pwm);
  // What all duties of late come to, by responses of (channels, duties), as long as the coils' own.
  double answer(const std::vector<float>& responses) const;
  size_t response_size() const { return size_t{channels_} * length_; }

 private:
  bool is_awake(uint32_t channel, const Pwm& pwm) const;
  void remember(const Pwm& pwm);
  void respond(uint64_t clock, const Pwm& pwm);
  double bumped(uint64_t clock) const;
  uint16_t convert(double steps);

  uint32_t channels_ = 0;
  uint32_t length_ = 0;
  std::vector<float> responses_;
  std::vector<std::complex<double>> carrier_;
  uint32_t late_ = 0;
  double noise_ = 0.0, bend_ = 0.0, begin_us_ = 0.0;
  Noise random_;
  SensingFaults faults_{};
  Bump bump_{};

  std::array<uint8_t, 8> registers_{0, 0, 0xFF, 0xFF, 0, 0, 0xFF, 0xFF};
  // Each channel's duties, twice in a row so that any `length_` of them lie together, and how many
  // of the last ones were 0.
  std::array<std::vector<float>, kMaxChannels> duties_;
  std::array<uint32_t, kMaxChannels> silent_for_{};
  uint32_t newest_ = 0;
  bool is_listening_ = false;
  bool has_lost_ = false;
  uint64_t from_period_ = 0;
  std::array<double, 4> steps_{};
  std::deque<uint16_t> values_;
};

}  // namespace chladni::emulator
