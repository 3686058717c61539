// The port expander that chooses what is listened to (TCA9555, docs/hardware.md). Its first four
// outputs are the multiplexer's address, the fifth puts the reference in its place. Of its second
// eight each keeps a bridge awake. After a power-on all are inputs, and pull-ups keep the bridges
// awake.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/link_format.hpp"
#include "core/hal.hpp"

namespace chladni::expander {

constexpr uint8_t kAddress = 0x20;
constexpr uint8_t kOutputs = 0x02, kDirections = 0x06;
constexpr uint8_t kAllAwake = 0xFF;
// A known share of the first coil's own voltage, in place of a coil.
constexpr uint8_t kReference = link_format::kReference;

// The levels first, so that no bridge falls asleep on the way.
inline bool set(const Hal& hal, uint8_t source, uint8_t awake) {
  constexpr uint32_t kBytes = 3;
  const std::array<uint8_t, kBytes> levels{kOutputs, source, awake}, all_out{kDirections, 0, 0};
  for (const auto& bytes : {levels, all_out}) {
    if (hal.i2c(hal.context, kAddress, bytes.data(), kBytes, nullptr, 0) != BusStatus::kOk) {
      return false;
    }
  }
  return true;
}

// While nothing is listened to: any coil may play, and none may be at the amplifier then, which
// its driver's volts would saturate.
inline bool rest(const Hal& hal) { return set(hal, kReference, kAllAwake); }

}  // namespace chladni::expander
