// What is an ESP32-S3's own: one group of LEDC channels, of the low-speed kind.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/gpio.hpp"
#include "driver/ledc.h"
#include "esp_adc/adc_continuous.h"

namespace chladni::chip {

constexpr gpio::Chip kChip = gpio::Chip::kEsp32s3;
constexpr std::array<ledc_mode_t, 1> kLedcGroups{LEDC_LOW_SPEED_MODE};
static_assert(LEDC_LOW_SPEED_MODE == 0, "its registers come first");
// Of the converter's values, 32 bits each.
constexpr adc_digi_output_format_t kConverterFormat = ADC_DIGI_OUTPUT_FORMAT_TYPE2;

}  // namespace chladni::chip
