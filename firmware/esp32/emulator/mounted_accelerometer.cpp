#include "emulator/mounted_accelerometer.hpp"

#include <cmath>

namespace chladni::emulator {

namespace {

constexpr size_t kMost = 32;
// LIS2DW12.
constexpr uint32_t kStControl1 = 0x20, kStControl2 = 0x21, kStControl6 = 0x25, kStMemory = 0x2E,
                   kStLevel = 0x2F, kStAxes = 0x28;
constexpr uint8_t kStCounting = 0x04;  // addresses go on by themselves
// ADXL345.
constexpr uint32_t kAdRate = 0x2C, kAdPower = 0x2D, kAdFormat = 0x31, kAdMemory = 0x38,
                   kAdLevel = 0x39, kAdAxes = 0x32;

}  // namespace

void MountedAccelerometer::mount(const Part& part, std::vector<float> responses) {
  part_ = part;
  responses_ = std::move(responses);
  registers_.fill(0);
  if (part_.model == AccelerometerModel::kLis2dw12) {
    registers_[0x0F] = 0x44;
    registers_[kStControl2] = kStCounting;
  } else {
    registers_[0x00] = 0xE5;
    registers_[kAdRate] = 0x0A;
  }
  kept_.clear();
  random_ = Noise(part.seed);
}

// At 800 Hz; the model has no other rate.
bool MountedAccelerometer::is_measuring() const {
  return part_.model == AccelerometerModel::kLis2dw12
             ? (registers_[kStControl1] & 0xFCU) == 0x84U
             : registers_[kAdRate] == 0x0DU && (registers_[kAdPower] & 8U) != 0;
}

bool MountedAccelerometer::keeps() const {
  return part_.model == AccelerometerModel::kLis2dw12 ? (registers_[kStMemory] >> 5) == 6U
                                                      : (registers_[kAdMemory] >> 6) == 2U;
}

// The value of a register; the first of the axes takes a sample out.
uint8_t MountedAccelerometer::at(uint32_t place) {
  const bool is_st = part_.model == AccelerometerModel::kLis2dw12;
  const uint32_t axes = is_st ? kStAxes : kAdAxes;
  if (place == (is_st ? kStLevel : kAdLevel)) return static_cast<uint8_t>(kept_.size());
  if (place == axes && !kept_.empty()) {
    out_ = kept_.front();
    kept_.pop_front();
  }
  if (place == axes + 4U) return static_cast<uint8_t>(out_.z & 0xFF);
  if (place == axes + 5U) return static_cast<uint8_t>((out_.z >> 8) & 0xFF);
  return place >= axes && place < axes + 6U ? uint8_t{0} : registers_[place % registers_.size()];
}

BusStatus MountedAccelerometer::transfer(const uint8_t* written, uint32_t write_count,
                                         uint8_t* read, uint32_t read_count) {
  if (write_count == 0) return BusStatus::kNoAnswer;
  const bool counts =
      part_.model == AccelerometerModel::kAdxl345 || (registers_[kStControl2] & kStCounting) != 0;
  for (uint32_t k = 1; k < write_count; ++k) {
    registers_[(written[0] + k - 1U) % registers_.size()] = written[k];
  }
  if (!keeps()) kept_.clear();
  for (uint32_t k = 0; k < read_count; ++k) read[k] = at(written[0] + (counts ? k : 0U));
  return BusStatus::kOk;
}

void MountedAccelerometer::sample(double g) {
  if (faults_.is_deaf || !keeps()) return;
  if (faults_.silent_samples > 0) {
    --faults_.silent_samples;
    return;
  }
  const double noise = part_.noise_g * random_.next();
  const bool is_st = part_.model == AccelerometerModel::kLis2dw12;
  // 14 bits of ± 2, 4, 8 or 16 g, left-justified; or 1/256 g each in 13 bits.
  const double range_g =
      is_st ? 2 << ((registers_[kStControl6] >> 4) & 3U) : 2 << (registers_[kAdFormat] & 3U);
  const double per_g = is_st ? 8192.0 / range_g : 256.0;
  const double most = is_st ? 8191.0 : range_g * 256.0 - 1.0;
  const double steps = std::nearbyint((g + part_.steady_g + noise) * per_g);
  const double held = steps > most ? most : (steps < -most - 1.0 ? -most - 1.0 : steps);
  kept_.push_back({static_cast<int16_t>(held * (is_st ? 4.0 : 1.0))});
  if (kept_.size() > kMost) kept_.pop_front();
}

void MountedAccelerometer::begin_period(uint64_t now_ns, const SensedCoils& coils) {
  if (responses_.empty() || !is_measuring()) return;
  if (next_ns_ == 0.0) next_ns_ = static_cast<double>(now_ns);
  if (static_cast<double>(now_ns) < next_ns_) return;
  next_ns_ += 1e9 / part_.clock_hz;
  sample(coils.answer(responses_));
}

}  // namespace chladni::emulator
