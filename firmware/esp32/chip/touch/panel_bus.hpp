// The touch panel's I2C bus, its interrupt line and its reset line.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/hal.hpp"
#include "esp_err.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"

namespace chladni::chip {

// `woken` is notified when the panel calls.
esp_err_t panel_bus_start(const Config& config, TaskHandle_t woken);

BusStatus panel_bus_transfer(uint8_t address, const uint8_t* written, uint32_t write_count,
                             uint8_t* read, uint32_t read_count);
void panel_bus_recover();
bool panel_has_called();

}  // namespace chladni::chip
