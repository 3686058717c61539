// What the chip must know before it has read its configuration.
//
// GPIO 2 is a strapping pin and GPIO 15 has a pull-up through reset, so firmware alone cannot keep
// those two gates low until it runs: the board needs pull-downs (docs/hardware.md).
#pragma once

#include "core/generated/config_format.hpp"
#include "sdkconfig.h"

#if !CONFIG_IDF_TARGET_ESP32 && !CONFIG_IDF_TARGET_ESP32S3
#error "Chladni runs on the ESP32 and the ESP32-S3."
#endif

namespace chladni::chip {

constexpr int kConsoleBaud = 115200;
// Half the LEDC's clock, from the same source: the two never drift apart.
constexpr uint32_t kTimerHz = 40000000;
constexpr uint32_t kCpuHz = CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ * 1000000;
static_assert(kCpuHz == 240000000, "samples are timed by 240 MHz: CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ");
// In place of a GPIO number: not connected.
constexpr uint8_t kNotWired = 255;

}  // namespace chladni::chip
