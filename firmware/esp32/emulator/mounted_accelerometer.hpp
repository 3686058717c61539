// An accelerometer that stands on the plate: an LIS2DW12 or an ADXL345 as registers on the bus,
// with a clock, a gain and noise of its own.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "core/generated/device_codes.hpp"
#include "core/hal.hpp"
#include "emulator/noise.hpp"
#include "emulator/sensed_coils.hpp"

namespace chladni::emulator {

struct AccelerometerFaults {
  bool is_absent = false;
  bool is_deaf = false;         // acknowledges, and its memory never fills
  uint32_t silent_samples = 0;  // of the next ones, none comes
};

class MountedAccelerometer {
 public:
  struct Part {
    AccelerometerModel model = AccelerometerModel::kNone;
    uint8_t address = 0;
    double clock_hz = 800.0;
    double noise_g = 0.0;
    double steady_g = 1.0;  // of the earth, by how it lies, and its own offset
    uint32_t seed = 1;
  };

  // Responses of (channels, duties), g for a duty of 1, as long as the coils' are.
  void mount(const Part& part, std::vector<float> responses);
  bool answers(uint8_t address) const {
    return part_.model != AccelerometerModel::kNone && address == part_.address &&
           !faults_.is_absent;
  }
  BusStatus transfer(const uint8_t* written, uint32_t write_count, uint8_t* read,
                     uint32_t read_count);
  // Once the duties of this carrier period are on the pins.
  void begin_period(uint64_t now_ns, const SensedCoils& coils);
  AccelerometerFaults& faults() { return faults_; }

 private:
  struct Axes {
    int16_t z;
  };

  bool is_measuring() const;
  bool keeps() const;
  uint8_t at(uint32_t place);
  void sample(double g);

  Part part_{};
  std::vector<float> responses_;
  AccelerometerFaults faults_{};
  std::array<uint8_t, 0x40> registers_{};
  std::deque<Axes> kept_;
  Axes out_{};
  double next_ns_ = 0.0;
  Noise random_;
};

}  // namespace chladni::emulator
