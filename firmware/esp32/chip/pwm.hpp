// Five LEDC outputs on one timer, written from the sample interrupt.
#pragma once

#include <cstdint>

#include "esp_err.h"

namespace chladni::chip {

// Hold every gate low; the first thing after reset.
void gates_low();

// Start the carrier with every duty at 0. Call once, before the sample timer runs.
esp_err_t pwm_start();

// Hand over a duty for the next carrier period. Safe with the flash cache off; neither spins nor
// locks. If the channel has not yet taken the last duty, this one is dropped and counted.
void pwm_set_duty(uint32_t channel, uint32_t duty_steps);

// Duties dropped since start.
uint32_t pwm_dropped();

}  // namespace chladni::chip
