// What outlasts a restart without flash: how warm the coils are, how often flash was written, and
// how often the firmware crashed.
//
// It lies in memory that keeps its content through resets and loses it with the power. Which of the
// two a start comes after cannot be told (a reset pin powers the chip off and on), so only the CRC
// says whether it counts. Without it coils are taken to be as hot as they may be.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/gpio.hpp"
#include "core/hal.hpp"

namespace chladni {

// How warm the coil of each GPIO is, whichever channel it was: microkelvin above the air, or not
// known.
struct PinHeat {
  static constexpr uint32_t kUnknown = UINT32_MAX;

  std::array<uint32_t, gpio::kPins> rise_uk{};
  // The limit, 0.1 K, that unknown coils were taken to be at, the highest since; 0 if none was.
  uint32_t assumed_dk = 0;
};

struct Retained {
  PinHeat heat;
  uint32_t is_on = 0;                     // outputs; then more has come since
  uint32_t erases = 0;                    // sectors, since power came on
  uint32_t write_credit_ms = UINT32_MAX;  // not known; see FlashWear
};

// What `keep` wrote last; if something else lies there, no coil is known.
Retained recall(const Hal& hal);
void keep(const Hal& hal, const Retained& state);

// Crashes since they were last forgotten, in a record of its own: a start reads it before anything
// that could crash. Adds one if this start comes after a crash.
uint32_t count_crash(const Hal& hal, bool has_crashed);
void forget_crashes(const Hal& hal);

}  // namespace chladni
