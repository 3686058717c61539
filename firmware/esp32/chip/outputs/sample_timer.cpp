#include "outputs/sample_timer.hpp"

#include "board.hpp"
#include "core/synthesis/sample_clock.hpp"
#include "driver/gptimer.h"
#include "esp_attr.h"
#include "esp_cpu.h"
#include "outputs/pwm.hpp"

namespace chladni::chip {

namespace {

constexpr uint32_t kCyclesPerTick = kCpuHz / kTimerHz;
// How often the timer is moved until it stands where it should, and how near that must be.
constexpr int kTries = 8;

// Of the interrupt alone.
DRAM_ATTR SampleClock sample_clock;

bool IRAM_ATTR on_alarm(gptimer_handle_t, const gptimer_alarm_event_data_t*, void* context) {
  // Alarms that came while this one was held up are lost; the cycle counter still knows them.
  uint32_t missed = 0;
  if (sample_clock.tick(esp_cpu_get_cycle_count(), missed)) {
    static_cast<Device*>(context)->sample(missed);
  }
  return false;  // no task was woken
}

// Move the timer until its alarm falls into the middle of a carrier period: the duties are written
// far from where they are latched. Both run from one clock, so it stays there.
esp_err_t align(gptimer_handle_t timer, uint32_t alarm_ticks, uint32_t carrier_steps) {
  esp_err_t status = ESP_OK;
  for (int k = 0; k < kTries && status == ESP_OK; ++k) {
    uint64_t ticks = 0;
    status = gptimer_get_raw_count(timer, &ticks);
    const uint32_t position = pwm_position();
    const auto count = static_cast<uint32_t>(ticks);
    // A tick is two steps.
    const uint32_t at_alarm = (position + 2U * (alarm_ticks - count)) % carrier_steps;
    const uint32_t too_late = (at_alarm + carrier_steps / 2U) % carrier_steps;
    if (too_late < carrier_steps / 8U || too_late > carrier_steps * 7U / 8U) return status;
    const uint32_t moved = count + too_late / 2U;
    if (status == ESP_OK) status = gptimer_set_raw_count(timer, moved % alarm_ticks);
  }
  return status;
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

  const uint32_t carrier_steps = 1U << device.config().pwm_bits;
  gptimer_alarm_config_t alarm{};
  alarm.alarm_count = carrier_steps / 2U * kCarrierPeriodsPerSample;
  alarm.reload_count = 0;
  alarm.flags.auto_reload_on_alarm = true;
  const uint32_t cycles_per_sample = static_cast<uint32_t>(alarm.alarm_count) * kCyclesPerTick;
  sample_clock.start(cycles_per_sample, esp_cpu_get_cycle_count() + cycles_per_sample);
  status = gptimer_set_alarm_action(timer, &alarm);
  if (status == ESP_OK) status = gptimer_enable(timer);
  if (status == ESP_OK) status = gptimer_start(timer);
  if (status == ESP_OK) {
    status = align(timer, static_cast<uint32_t>(alarm.alarm_count), carrier_steps);
  }
  return status;
}

}  // namespace chladni::chip
