// The device's configuration, kept in two sectors of flash that are written in turn: a cut while
// one is written leaves the other.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/generated/device_codes.hpp"
#include "core/generated/gpio.hpp"
#include "core/hal.hpp"

namespace chladni {

// A configuration's `driver`: what stands between a pin and its coil.
constexpr uint32_t kBridge = 1;

// Records of 2.2 and before have 0, which is no converter's pin.
inline bool has_sensing_pin(const Config& config) {
  return config.sense_pin != 0 && config.sense_pin != gpio::kNotWired;
}

// The newest whole record, or the defaults; says which. kOlder with a record that a newer one has
// replaced, which cannot be read any more.
ConfigStatus load_config(const Hal& hal, Config& config);

// The first GPIO that its role cannot have on a chip, or that has two; kNotWired + 1 for none.
// Without a panel the panel's pins do not count. The same rules as chladni.sim.board.gpio.
uint32_t bad_pin(const Config& config, gpio::Chip chip);
constexpr uint32_t kNoBadPin = gpio::kNotWired + 1U;

// The settings of a record that is whole and has each in its range, whatever the chip.
ConfigStatus parse_settings(const uint8_t* record, uint32_t bytes, Config& config);
// The settings of a record, if it is whole, every one lies in its range and every pin can be what
// it is to be on the chip; else `config` is of no use.
ConfigStatus parse_record(const uint8_t* record, uint32_t bytes, gpio::Chip chip, Config& config);
// config_format::kRecordBytes of a record.
void write_record(const Config& config, uint32_t sequence, uint8_t* record);

// Whether the newest record says the same and counts, so that there is nothing to write.
bool holds_config(const Hal& hal, const Config& config);
// Write a record to the sector that does not hold the newest, read it back and compare. Whatever
// happens, the newest record so far stays.
ConfigStatus save_config(const Hal& hal, const Config& config);

// A host on a network may ask for less than what was last written by wire; pins, channels, the
// carrier and what else protects parts are as they are. False if it asks for anything else.
bool may_ask_over_network(const Config& in_force, const Config& wanted);

}  // namespace chladni
