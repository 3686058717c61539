// What is an ESP32's own: two groups of LEDC channels.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/gpio.hpp"
#include "driver/ledc.h"
#include "esp_adc/adc_continuous.h"
#include "soc/ledc_reg.h"

namespace chladni::chip {

constexpr gpio::Chip kChip = gpio::Chip::kEsp32;
// In the channels' order, eight each, a timer to each group.
constexpr std::array<ledc_mode_t, 2> kLedcGroups{LEDC_HIGH_SPEED_MODE, LEDC_LOW_SPEED_MODE};
static_assert(LEDC_HIGH_SPEED_MODE == 0 && LEDC_LOW_SPEED_MODE == 1, "registers in this order");
// Of the converter's values, 16 bits each.
constexpr adc_digi_output_format_t kConverterFormat = ADC_DIGI_OUTPUT_FORMAT_TYPE1;
// The groups' registers have their bits in the same places.
static_assert(LEDC_HSTIMER0_RST == LEDC_LSTIMER0_RST);
static_assert(LEDC_DUTY_START_HSCH0 == LEDC_DUTY_START_LSCH0);

}  // namespace chladni::chip
