// LEDC outputs, eight to a timer, timers that start together, written from the sample interrupt.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "esp_err.h"

namespace chladni::chip {

// Hold every gate low; the first thing after reset, and again once the configuration is known.
void gates_low(const Config& config);

// Start the carrier with every duty at 0. Call once, before the sample timer runs.
esp_err_t pwm_start(const Config& config);

// Hand over all duties for the next carrier period. Safe with the flash cache off; neither spins
// nor locks. What a channel has not yet taken is not overwritten: the new one is dropped and
// counted, and the one that stays takes its place in `duties`. `signs`: the sign pins that are to
// be high (hal.hpp).
void pwm_set_duties(int32_t* duties, uint32_t signs);

// Duties dropped since start.
uint32_t pwm_dropped();

// Position in the carrier period now, in its steps.
uint32_t pwm_position();

// Where in the carrier period the last of the duties was written; kNeverWritten if none was since
// it was last asked.
uint32_t pwm_written_at();
constexpr uint32_t kNeverWritten = 0xFFFFFFFFU;

// Steps of 12.5 ns by which channels from 8 on lag the others, as measured at start; constant
// since.
int32_t pwm_group_lag();

// Take the gates from the PWM and pull them low, from any context, even with half the chip dead.
void cut_outputs();

}  // namespace chladni::chip
