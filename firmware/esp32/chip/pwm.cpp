#include "pwm.hpp"

#include <atomic>

#include "board.hpp"
#include "driver/gpio.h"
#include "driver/ledc.h"
#include "esp_attr.h"
#include "hal/ledc_ll.h"

namespace chladni::chip {

namespace {

// All channels share one timer, so that their phases hold. High-speed channels take a duty over at
// the end of a carrier period without a further command.
constexpr ledc_mode_t kMode = LEDC_HIGH_SPEED_MODE;
constexpr ledc_timer_t kTimer = LEDC_TIMER_0;
constexpr uint32_t kClockHz = 80000000;

// Written by the interrupt alone.
DRAM_ATTR std::atomic<uint32_t> dropped{0};

}  // namespace

void gates_low() {
  uint64_t pins = 0;
  for (const gpio_num_t pin : kPwmPins) {
    // The level first: the register may still hold a 1 from before a software reset.
    gpio_set_level(pin, 0);
    pins |= 1ULL << static_cast<uint32_t>(pin);
  }
  gpio_config_t config{};
  config.pin_bit_mask = pins;
  config.mode = GPIO_MODE_OUTPUT;
  config.pull_up_en = GPIO_PULLUP_DISABLE;
  config.pull_down_en = GPIO_PULLDOWN_ENABLE;
  config.intr_type = GPIO_INTR_DISABLE;
  gpio_config(&config);
}

esp_err_t pwm_start() {
  ledc_timer_config_t timer{};
  timer.speed_mode = kMode;
  timer.duty_resolution = static_cast<ledc_timer_bit_t>(kSettings.pwm_bits);
  timer.timer_num = kTimer;
  timer.freq_hz = kClockHz >> kSettings.pwm_bits;
  timer.clk_cfg = LEDC_USE_APB_CLK;
  esp_err_t status = ledc_timer_config(&timer);
  for (uint32_t k = 0; k < kPwmPins.size() && status == ESP_OK; ++k) {
    ledc_channel_config_t channel{};
    channel.gpio_num = kPwmPins[k];
    channel.speed_mode = kMode;
    channel.channel = static_cast<ledc_channel_t>(k);
    channel.timer_sel = kTimer;
    channel.duty = 0;
    channel.hpoint = 0;
    status = ledc_channel_config(&channel);
  }
  return status;
}

void IRAM_ATTR pwm_set_duty(uint32_t channel, uint32_t duty_steps) {
  // The driver's own calls take a spinlock and live in flash, and ledc_ll_set_duty_start waits
  // for the last duty to be taken over: so look first, and never wait.
  const auto number = static_cast<ledc_channel_t>(channel);
  if (LEDC.channel_group[kMode].channel[number].conf1.duty_start != 0) {
    dropped.store(dropped.load(std::memory_order_relaxed) + 1U, std::memory_order_relaxed);
    return;
  }
  ledc_ll_set_duty_int_part(&LEDC, kMode, number, duty_steps);
  ledc_ll_set_duty_start(&LEDC, kMode, number);
}

uint32_t pwm_dropped() { return dropped.load(std::memory_order_relaxed); }

}  // namespace chladni::chip
