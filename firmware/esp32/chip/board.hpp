// The authors' board: five low-side switches on an ESP32-WROOM-32D, console on UART0.
//
// GPIO 2 is a strapping pin and GPIO 15 has a pull-up through reset, so firmware alone cannot keep
// those two gates low until it runs: the board needs pull-downs (docs/hardware.md).
#pragma once

#include <array>
#include <cstdint>

#include "core/device.hpp"
#include "hal/gpio_types.h"

namespace chladni::chip {

constexpr std::array<gpio_num_t, 5> kPwmPins = {GPIO_NUM_2, GPIO_NUM_4, GPIO_NUM_15, GPIO_NUM_16,
                                                GPIO_NUM_17};

// Carrier 80 MHz / 2^10 = 78,125 Hz, level 80 %: the rest is headroom.
constexpr DeviceSettings kSettings = {kPwmPins.size(), 10, 26214};

constexpr int kConsoleBaud = 115200;

}  // namespace chladni::chip
