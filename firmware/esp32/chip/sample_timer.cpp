#include "sample_timer.hpp"

#include "board.hpp"
#include "driver/gptimer.h"
#include "esp_attr.h"

namespace chladni::chip {

namespace {

// Half the LEDC clock, from the same source: the two never drift apart.
constexpr uint32_t kTimerHz = 40000000;
constexpr uint32_t kTicksPerCarrierPeriod = (1U << kSettings.pwm_bits) / 2;

bool IRAM_ATTR on_alarm(gptimer_handle_t, const gptimer_alarm_event_data_t*, void* context) {
  static_cast<Device*>(context)->sample();
  return false;  // no task was woken
}

}  // namespace

esp_err_t sample_timer_start(Device& device) {
  gptimer_config_t config{};
  config.clk_src = GPTIMER_CLK_SRC_APB;
  config.direction = GPTIMER_COUNT_UP;
  config.resolution_hz = kTimerHz;
  config.intr_priority = 3;
  gptimer_handle_t timer = nullptr;
  esp_err_t status = gptimer_new_timer(&config, &timer);
  if (status != ESP_OK) return status;

  gptimer_event_callbacks_t callbacks{};
  callbacks.on_alarm = on_alarm;
  status = gptimer_register_event_callbacks(timer, &callbacks, &device);
  if (status != ESP_OK) return status;

  gptimer_alarm_config_t alarm{};
  alarm.alarm_count = kTicksPerCarrierPeriod * kCarrierPeriodsPerSample;
  alarm.reload_count = 0;
  alarm.flags.auto_reload_on_alarm = true;
  status = gptimer_set_alarm_action(timer, &alarm);
  if (status == ESP_OK) status = gptimer_enable(timer);
  if (status == ESP_OK) status = gptimer_start(timer);
  return status;
}

}  // namespace chladni::chip
