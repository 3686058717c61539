// The device's configuration, kept in two sectors of flash that are written in turn: a cut while
// one is written leaves the other.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/generated/device_codes.hpp"
#include "core/generated/gpio.hpp"
#include "core/hal.hpp"

namespace chladni {

// The newest whole record, or the defaults; says which.
ConfigStatus load_config(const Hal& hal, Config& config);

// The first GPIO that its role cannot have on this chip, or that has two; kNotWired + 1 for none.
// Without a panel the panel's pins do not count. The same rules as chladni.sim.board.gpio.
uint32_t bad_pin(const Config& config);
constexpr uint32_t kNoBadPin = gpio::kNotWired + 1U;

// The settings of a record, if it is whole, every one lies in its range and every pin can be what
// it is to be.
ConfigStatus parse_record(const uint8_t* record, uint32_t bytes, Config& config);
// config_format::kRecordBytes of a record.
void write_record(const Config& config, uint32_t sequence, uint8_t* record);

// Write a record to the sector that does not hold the newest, read it back and compare. Whatever
// happens, the newest record so far stays.
ConfigStatus save_config(const Hal& hal, const Config& config);

}  // namespace chladni
