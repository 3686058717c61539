#include "outputs/pwm.hpp"

#include <atomic>

#include "board.hpp"
#include "driver/gpio.h"
#include "driver/ledc.h"
#include "esp_attr.h"
#include "hal/ledc_ll.h"
#include "soc/gpio_reg.h"
#include "soc/gpio_sig_map.h"
#include "soc/soc.h"

namespace chladni::chip {

namespace {

// All channels share one timer, so that their phases hold. High-speed channels take a duty over at
// the end of a carrier period without a further command; there are eight.
constexpr ledc_mode_t kMode = LEDC_HIGH_SPEED_MODE;
constexpr ledc_timer_t kTimer = LEDC_TIMER_0;
constexpr uint32_t kClockHz = 80000000;
constexpr uint32_t kMostChannels = 8;

// Read by the interrupt, and by what runs when everything else is lost.
DRAM_ATTR uint32_t channels = 0;
DRAM_ATTR uint64_t gates = 0;
// Written by the interrupt alone.
DRAM_ATTR std::atomic<uint32_t> dropped{0};

uint64_t pins_of(const Config& config) {
  uint64_t pins = 0;
  for (uint32_t k = 0; k < config.channels; ++k) {
    if (config.pwm_pins[k] < GPIO_NUM_MAX) pins |= 1ULL << config.pwm_pins[k];
  }
  return pins;
}

}  // namespace

void gates_low(const Config& config) {
  gates = pins_of(config);
  // The level first: the register may still hold a 1 from before a software reset.
  for (uint32_t pin = 0; pin < GPIO_NUM_MAX; ++pin) {
    if (((gates >> pin) & 1U) != 0) gpio_set_level(static_cast<gpio_num_t>(pin), 0);
  }
  gpio_config_t setting{};
  setting.pin_bit_mask = gates;
  setting.mode = GPIO_MODE_OUTPUT;
  setting.pull_up_en = GPIO_PULLUP_DISABLE;
  setting.pull_down_en = GPIO_PULLDOWN_ENABLE;
  setting.intr_type = GPIO_INTR_DISABLE;
  gpio_config(&setting);
}

esp_err_t pwm_start(const Config& config) {
  if (config.channels > kMostChannels) return ESP_ERR_NOT_SUPPORTED;
  ledc_timer_config_t timer{};
  timer.speed_mode = kMode;
  timer.duty_resolution = static_cast<ledc_timer_bit_t>(config.pwm_bits);
  timer.timer_num = kTimer;
  timer.freq_hz = kClockHz >> config.pwm_bits;
  timer.clk_cfg = LEDC_USE_APB_CLK;
  esp_err_t status = ledc_timer_config(&timer);
  for (uint32_t k = 0; k < config.channels && status == ESP_OK; ++k) {
    ledc_channel_config_t channel{};
    channel.gpio_num = config.pwm_pins[k];
    channel.speed_mode = kMode;
    channel.channel = static_cast<ledc_channel_t>(k);
    channel.timer_sel = kTimer;
    channel.duty = 0;
    channel.hpoint = 0;
    status = ledc_channel_config(&channel);
  }
  if (status == ESP_OK) channels = config.channels;
  return status;
}

void IRAM_ATTR pwm_set_duties(const uint32_t* duties) {
  // The driver's own calls take a spinlock and live in flash, and ledc_ll_set_duty_start waits
  // for the last duty to be taken over: so look first, and never wait.
  for (uint32_t k = 0; k < channels; ++k) {
    const auto number = static_cast<ledc_channel_t>(k);
    if (LEDC.channel_group[kMode].channel[number].conf1.duty_start != 0) {
      dropped.store(dropped.load(std::memory_order_relaxed) + 1U, std::memory_order_relaxed);
      continue;
    }
    ledc_ll_set_duty_int_part(&LEDC, kMode, number, duties[k]);
    ledc_ll_set_duty_start(&LEDC, kMode, number);
  }
}

uint32_t pwm_dropped() { return dropped.load(std::memory_order_relaxed); }

uint32_t pwm_position() { return LEDC.timer_group[kMode].timer[kTimer].value.timer_cnt; }

void IRAM_ATTR cut_outputs() {
  // The interrupt on the other core may go on writing duties: what it writes must lead nowhere.
  REG_WRITE(GPIO_OUT_W1TC_REG, static_cast<uint32_t>(gates));
  REG_WRITE(GPIO_OUT1_W1TC_REG, static_cast<uint32_t>(gates >> 32));
  for (uint32_t pin = 0; pin < GPIO_NUM_MAX; ++pin) {
    if (((gates >> pin) & 1U) != 0) {
      REG_WRITE(GPIO_FUNC0_OUT_SEL_CFG_REG + 4U * pin, SIG_GPIO_OUT_IDX);
    }
  }
  REG_WRITE(GPIO_ENABLE_W1TS_REG, static_cast<uint32_t>(gates));
  REG_WRITE(GPIO_ENABLE1_W1TS_REG, static_cast<uint32_t>(gates >> 32));
}

}  // namespace chladni::chip
