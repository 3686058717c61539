// An accelerometer that stands on the plate, on the panel's bus (docs/hardware.md): an LIS2DW12 or
// an ADXL345, whichever answers. It samples by a clock of its own, 800 times a second, and keeps
// 32 samples. When each is found there says what its clock does; the host works that out.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"
#include "core/generated/link_format.hpp"
#include "core/hal.hpp"

namespace chladni {

struct Motion {
  int16_t z;
  uint16_t found_at;  // samples of the outputs
};

class Accelerometer {
 public:
  // In the order in which they are asked for; the chip layer has them on its bus.
  static constexpr std::array<uint8_t, 4> kAddresses{0x19, 0x18, 0x53, 0x1D};

  // Looks for one, and has it measure. False if there is none.
  bool begin(const Hal& hal);
  // What it has kept so far is forgotten; `count` samples are taken from now on.
  bool take(const Hal& hal, uint32_t count);
  // What has come since the last turn. False if some were lost, or it does not answer.
  bool read(const Hal& hal, uint32_t now_samples);
  bool is_full() const { return count_ == wanted_; }

  AccelerometerModel model() const { return model_; }
  uint32_t count() const { return count_; }
  const Motion& at(uint32_t k) const { return motions_[k]; }

 private:
  bool set(const Hal& hal, uint8_t place, uint8_t value) const;
  bool get(const Hal& hal, uint8_t place, uint8_t* bytes, uint32_t count) const;

  AccelerometerModel model_ = AccelerometerModel::kNone;
  uint8_t address_ = 0;
  uint32_t wanted_ = 0;
  uint32_t count_ = 0;
  std::array<Motion, link_format::kMostMotions> motions_{};
};

}  // namespace chladni
