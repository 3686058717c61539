// GT911: registers from Goodix's programming guide (hardware.md has the table).
#include "core/touch/panel.hpp"

namespace chladni::gt911 {

namespace {

constexpr uint16_t kProduct = 0x8140;  // "911"
constexpr uint16_t kState = 0x814E;    // bit 7: ready, bit 6: a large area, bits 3 to 0: fingers
constexpr uint8_t kReady = 0x80, kLarge = 0x40;
constexpr uint32_t kPointBytes = 8;

struct Register {
  std::array<uint8_t, 2> bytes;
  explicit constexpr Register(uint32_t place)
      : bytes{static_cast<uint8_t>(place >> 8), static_cast<uint8_t>(place & 0xFFU)} {}
};

BusStatus get(const Hal& hal, uint8_t address, uint32_t place, uint8_t* bytes, uint32_t count) {
  const Register from(place);
  return hal.i2c(hal.context, address, from.bytes.data(), 2, bytes, count);
}

}  // namespace

BusStatus start(const Hal& hal, uint8_t address) {
  std::array<uint8_t, 3> product{};
  const BusStatus status = get(hal, address, kProduct, product.data(), 3);
  if (status != BusStatus::kOk) return status;
  const bool is_it = product[0] == '9' && product[1] == '1' && product[2] == '1';
  return is_it ? BusStatus::kOk : BusStatus::kNoAnswer;
}

PanelStatus read(const Hal& hal, uint8_t address, PanelReport& report) {
  std::array<uint8_t, 1 + kMostListed * kPointBytes> bytes{};
  BusStatus status = get(hal, address, kState, bytes.data(), 1 + kPointBytes);
  if (status != BusStatus::kOk) return to_panel(status);
  if ((bytes[0] & kReady) == 0) return PanelStatus::kNothingNew;
  uint32_t count = bytes[0] & 0x0FU;
  if (count > kMostListed) count = 0;  // 0x0F is read while it starts
  if (count > 1) {
    status = get(hal, address, kState, bytes.data(), 1 + count * kPointBytes);
    if (status != BusStatus::kOk) return to_panel(status);
  }
  // Only now: the panel measures on once its flag is cleared, and never without.
  constexpr Register kFlag(kState);
  const std::array<uint8_t, 3> clear = {kFlag.bytes[0], kFlag.bytes[1], 0};
  status = hal.i2c(hal.context, address, clear.data(), 3, nullptr, 0);
  if (status != BusStatus::kOk) return to_panel(status);
  report.count = count;
  report.is_palm = (bytes[0] & kLarge) != 0;
  for (uint32_t k = 0; k < count; ++k) {
    const uint8_t* point = &bytes[1 + k * kPointBytes];
    report.fingers[k] = {point[0], static_cast<uint16_t>(point[1] | (point[2] << 8)),
                         static_cast<uint16_t>(point[3] | (point[4] << 8))};
  }
  return PanelStatus::kReport;
}

}  // namespace chladni::gt911
