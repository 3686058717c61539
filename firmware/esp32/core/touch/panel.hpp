// Touch panels on I2C: what they report, in their own pixels.
//
// Two families: FT6236/FT6336 at 0x38 and GT911 at 0x5D or 0x14. Both have quirks that stay in
// their drivers: a report says what the panel sees, and whether that is news.
#pragma once

#include <array>
#include <cstdint>

#include "core/hal.hpp"

namespace chladni {

constexpr uint32_t kMaxFingers = 5;
// That a GT911 can be set to list.
constexpr uint32_t kMostListed = 10;

struct Finger {
  uint8_t id;
  uint16_t x;
  uint16_t y;
};

struct PanelReport {
  uint32_t count = 0;
  std::array<Finger, kMostListed> fingers{};
  bool is_palm = false;  // more than fingers lies on it
};

enum class PanelStatus : uint8_t {
  kReport,      // fingers, or none, as they are now
  kNothingNew,  // the panel has not measured since the last read
  kNoAnswer,    // no panel at the address
  kStuck,       // the bus is held
};

inline PanelStatus to_panel(BusStatus status) {
  return status == BusStatus::kNoAnswer ? PanelStatus::kNoAnswer : PanelStatus::kStuck;
}

// FT6236, FT6236U, FT6336 (and FT6206).
namespace ft6x36 {

// Whether one answers; if so it is kept out of its slow monitor mode and told to pulse its line.
BusStatus start(const Hal& hal);
// It has no flag for news: what it says may be old, which only its line can tell.
PanelStatus read(const Hal& hal, PanelReport& report);

}  // namespace ft6x36

namespace gt911 {

constexpr std::array<uint8_t, 2> kAddresses = {0x5D, 0x14};

BusStatus start(const Hal& hal, uint8_t address);
PanelStatus read(const Hal& hal, uint8_t address, PanelReport& report);

}  // namespace gt911

}  // namespace chladni
