// The analogue-to-digital converter that listens to coils, by ESP-IDF's continuous driver.
#pragma once

#include <cstdint>

namespace chladni::chip {

// Converts 78,125 times a second, from the clock that the carrier has; false if it does not. Memory
// for it is there only until it stops.
bool converter_start(uint8_t pin);
// What it has read since, as hal.hpp says.
uint32_t converter_heard(uint16_t* values, uint32_t most);
void converter_stop();

}  // namespace chladni::chip
