// The chip's registers as plain memory, and what else chip/outputs/pwm.cpp asks of ESP-IDF: to
// count the instructions of a sample's writes.
#pragma once

#include <stdint.h>

#define CONFIG_IDF_TARGET_ESP32 1
#define CONFIG_IDF_TARGET_ESP32S3 0
#define CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ 240
#define IRAM_ATTR
#define DRAM_ATTR

using esp_err_t = int;
constexpr esp_err_t ESP_OK = 0, ESP_ERR_INVALID_STATE = 0x103;

struct portMUX_TYPE {};
#define portMUX_INITIALIZER_UNLOCKED \
  {                                  \
  }
#define portENTER_CRITICAL(lock) (void)(lock)
#define portEXIT_CRITICAL(lock) (void)(lock)

using gpio_num_t = int;
constexpr gpio_num_t GPIO_NUM_MAX = 40;
enum { GPIO_MODE_OUTPUT, GPIO_PULLUP_DISABLE, GPIO_PULLDOWN_ENABLE, GPIO_INTR_DISABLE };
struct gpio_config_t {
  uint64_t pin_bit_mask;
  int mode, pull_up_en, pull_down_en, intr_type;
};
inline esp_err_t gpio_config(const gpio_config_t*) { return ESP_OK; }
inline esp_err_t gpio_set_level(gpio_num_t, uint32_t) { return ESP_OK; }

// A register for each word from GPIO_OUT_W1TS_REG on.
inline volatile uint32_t gpio_registers[0x200];
constexpr uint32_t GPIO_OUT_W1TS_REG = 0x0, GPIO_OUT_W1TC_REG = 0x4, GPIO_OUT1_W1TC_REG = 0x10;
constexpr uint32_t GPIO_ENABLE_W1TS_REG = 0x1C, GPIO_ENABLE1_W1TS_REG = 0x28;
constexpr uint32_t GPIO_FUNC0_OUT_SEL_CFG_REG = 0x528, SIG_GPIO_OUT_IDX = 256;
inline void REG_WRITE(uint32_t offset, uint32_t value) { gpio_registers[offset / 4U] = value; }

using ledc_mode_t = int;
using ledc_timer_t = int;
using ledc_channel_t = int;
using ledc_timer_bit_t = int;
constexpr ledc_mode_t LEDC_HIGH_SPEED_MODE = 0, LEDC_LOW_SPEED_MODE = 1;
constexpr ledc_timer_t LEDC_TIMER_0 = 0;
constexpr int LEDC_USE_APB_CLK = 1;
constexpr uint32_t LEDC_DUTY_START_HSCH0 = 1U << 31, LEDC_DUTY_START_LSCH0 = 1U << 31;
constexpr uint32_t LEDC_HSTIMER0_RST = 1U << 24, LEDC_LSTIMER0_RST = 1U << 24;
constexpr uint32_t LEDC_PARA_UP_LSCH0 = 1U << 4;
struct ledc_timer_config_t {
  ledc_mode_t speed_mode;
  ledc_timer_bit_t duty_resolution;
  ledc_timer_t timer_num;
  uint32_t freq_hz;
  int clk_cfg;
};
struct ledc_channel_config_t {
  int gpio_num;
  ledc_mode_t speed_mode;
  ledc_channel_t channel;
  ledc_timer_t timer_sel;
  uint32_t duty;
  int hpoint;
};
inline esp_err_t ledc_timer_config(const ledc_timer_config_t*) { return ESP_OK; }
inline esp_err_t ledc_channel_config(const ledc_channel_config_t*) { return ESP_OK; }

enum adc_digi_output_format_t { ADC_DIGI_OUTPUT_FORMAT_TYPE1, ADC_DIGI_OUTPUT_FORMAT_TYPE2 };

struct ledc_register_t {
  uint32_t val;
};
// In the order of the chip's (ESP32 TRM, LED PWM Controller).
struct ledc_channel_registers_t {
  ledc_register_t conf0, hpoint, duty, conf1, duty_rd;
};
struct ledc_timer_registers_t {
  ledc_register_t conf;
  struct {
    uint32_t timer_cnt;
  } value;
};
struct ledc_dev_t {
  struct {
    ledc_channel_registers_t channel[8];
  } channel_group[2];
  struct {
    ledc_timer_registers_t timer[4];
  } timer_group[2];
};
inline volatile ledc_dev_t LEDC;
