// FT6236 and FT6336: registers from the data sheet of the FT6236 (hardware.md has the table).
#include "core/touch/panel.hpp"

namespace chladni::ft6x36 {

namespace {

constexpr uint8_t kAddress = 0x38;
constexpr uint8_t kCount = 0x02;
// Of the first point, from kCount on; the second lies six further.
constexpr uint32_t kFirst = 1, kPointBytes = 6, kPoints = 2;
constexpr uint8_t kStayActive = 0x86;  // 0: never into the monitor mode, which reports slowly
constexpr uint8_t kLineMode = 0xA4;    // 1: a pulse for every report
constexpr uint8_t kChip = 0xA3;
constexpr std::array<uint8_t, 3> kChips = {0x36, 0x64, 0x06};
constexpr uint8_t kUp = 1, kNone = 3;

BusStatus set(const Hal& hal, uint8_t place, uint8_t value) {
  const std::array<uint8_t, 2> bytes = {place, value};
  return hal.i2c(hal.context, kAddress, bytes.data(), 2, nullptr, 0);
}

}  // namespace

BusStatus start(const Hal& hal) {
  uint8_t chip = 0;
  const BusStatus status = hal.i2c(hal.context, kAddress, &kChip, 1, &chip, 1);
  if (status != BusStatus::kOk) return status;
  bool is_known = false;
  for (const uint8_t known : kChips) is_known = is_known || chip == known;
  if (!is_known) return BusStatus::kNoAnswer;
  const BusStatus stays = set(hal, kStayActive, 0);
  return stays == BusStatus::kOk ? set(hal, kLineMode, 1) : stays;
}

PanelStatus read(const Hal& hal, PanelReport& report) {
  std::array<uint8_t, kFirst + kPoints * kPointBytes> bytes{};
  // Most touches are of one finger: the second is only fetched when there is one.
  constexpr uint32_t kOne = kFirst + 4;
  BusStatus status = hal.i2c(hal.context, kAddress, &kCount, 1, bytes.data(), kOne);
  if (status != BusStatus::kOk) return to_panel(status);
  uint32_t count = bytes[0] & 0x0FU;
  if (count > kPoints) count = 0;  // 0x0F is read while it starts
  if (count == kPoints) {
    status = hal.i2c(hal.context, kAddress, &kCount, 1, bytes.data(),
                     static_cast<uint32_t>(bytes.size()));
    if (status != BusStatus::kOk) return to_panel(status);
  }
  report.count = 0;
  for (uint32_t k = 0; k < count; ++k) {
    const uint8_t* point = &bytes[kFirst + k * kPointBytes];
    const uint32_t event = point[0] >> 6;
    if (event == kUp || event == kNone) continue;
    Finger& finger = report.fingers[report.count++];
    finger.id = static_cast<uint8_t>(point[2] >> 4);
    finger.x = static_cast<uint16_t>(((point[0] & 0x0FU) << 8) | point[1]);
    finger.y = static_cast<uint16_t>(((point[2] & 0x0FU) << 8) | point[3]);
  }
  return PanelStatus::kReport;
}

}  // namespace chladni::ft6x36
