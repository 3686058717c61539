#include "core/sensing/accelerometer.hpp"

namespace chladni {

namespace {

struct Setting {
  uint8_t place;
  uint8_t value;
};

// Registers of a model (its data sheet).
struct Registers {
  AccelerometerModel model;
  uint8_t name_at, name;
  std::array<Setting, 3> settings;
  // Of its memory: without one it is empty, then it goes on and drops the oldest.
  Setting emptied, kept;
  uint8_t level_at, level_mask;
  uint8_t axes_at;  // x, y and z, the low byte first; reading them takes a sample out
};

constexpr uint32_t kModels = 2, kAddressesEach = 2;
constexpr std::array<Registers, kModels> kRegisters{{
    {AccelerometerModel::kLis2dw12,
     0x0F,
     0x44,
     // Bytes that belong together; ±8 g with little noise; 800 Hz with 14 bits.
     {{{0x21, 0x0C}, {0x25, 0x24}, {0x20, 0x84}}},
     {0x2E, 0x00},
     {0x2E, 0xC0},
     0x2F,
     0x3F,
     0x28},
    {AccelerometerModel::kAdxl345,
     0x00,
     0xE5,
     // 800 Hz, the most that 400 kHz of the bus can take; ±16 g with all bits; measuring.
     {{{0x2C, 0x0D}, {0x31, 0x0B}, {0x2D, 0x08}}},
     {0x38, 0x00},
     {0x38, 0x80},
     0x39,
     0x3F,
     0x32},
}};
constexpr uint32_t kKept = 32;
constexpr uint32_t kAxesBytes = 6;
// Of a turn: more than come in its millisecond, so that it catches up after a long one.
constexpr uint32_t kMostInTurn = 3;

const Registers& registers_of(AccelerometerModel model) {
  return kRegisters[model == AccelerometerModel::kAdxl345 ? 1 : 0];
}

}  // namespace

bool Accelerometer::set(const Hal& hal, uint8_t place, uint8_t value) const {
  const std::array<uint8_t, 2> bytes{place, value};
  return hal.i2c(hal.context, address_, bytes.data(), bytes.size(), nullptr, 0) == BusStatus::kOk;
}

bool Accelerometer::get(const Hal& hal, uint8_t place, uint8_t* bytes, uint32_t count) const {
  return hal.i2c(hal.context, address_, &place, 1, bytes, count) == BusStatus::kOk;
}

bool Accelerometer::begin(const Hal& hal) {
  model_ = AccelerometerModel::kNone;
  wanted_ = count_ = 0;
  for (uint32_t k = 0; k < kAddresses.size() && model_ == AccelerometerModel::kNone; ++k) {
    const Registers& own = kRegisters[k / kAddressesEach];
    address_ = kAddresses[k];
    uint8_t name = 0;
    if (get(hal, own.name_at, &name, 1) && name == own.name) model_ = own.model;
  }
  if (model_ == AccelerometerModel::kNone) return false;
  for (const Setting& own : registers_of(model_).settings) {
    if (!set(hal, own.place, own.value)) return false;
  }
  return true;
}

bool Accelerometer::take(const Hal& hal, uint32_t count) {
  const Registers& own = registers_of(model_);
  wanted_ = count;
  count_ = 0;
  return set(hal, own.emptied.place, own.emptied.value) && set(hal, own.kept.place, own.kept.value);
}

bool Accelerometer::read(const Hal& hal, uint32_t now_samples) {
  const Registers& own = registers_of(model_);
  uint8_t level = 0;
  if (!get(hal, own.level_at, &level, 1)) return false;
  const uint32_t there = level & own.level_mask;
  if (there >= kKept) return false;
  for (uint32_t k = 0; k < there && k < kMostInTurn && !is_full(); ++k) {
    std::array<uint8_t, kAxesBytes> axes;
    if (!get(hal, own.axes_at, axes.data(), kAxesBytes)) return false;
    motions_[count_++] = {static_cast<int16_t>(axes[4] | (axes[5] << 8)),
                          static_cast<uint16_t>(now_samples)};
  }
  return true;
}

}  // namespace chladni
