#include "outputs/sample_timer.hpp"

#include "board.hpp"
#include "core/synthesis/sample_clock.hpp"
#include "driver/gptimer.h"
#include "esp_attr.h"
#include "esp_cpu.h"
#include "esp_intr_alloc.h"
#include "hal/timer_ll.h"
#include "outputs/pwm.hpp"
#include "soc/timer_periph.h"

namespace chladni::chip {

namespace {

constexpr uint32_t kCyclesPerTick = kCpuHz / kTimerHz;
// How often in a row the timer is moved until it stands where it should.
constexpr int kTries = 8;

// The driver sets the timer up and moves it. Its own interrupt reads the count and takes a lock at
// each alarm, which is not needed here: so the interrupt is ours. The first timer that the driver
// gives is this one, and no other is asked for.
constexpr int kGroup = 0;
constexpr uint32_t kNumber = 0;
constexpr uint32_t kAlarm = TIMER_LL_EVENT_ALARM(kNumber);
constexpr int kInterruptFlags = ESP_INTR_FLAG_LEVEL3 | ESP_INTR_FLAG_IRAM;

// Of the interrupt alone.
DRAM_ATTR SampleClock sample_clock;

void IRAM_ATTR on_alarm(void* context) {
  timg_dev_t* const hardware = TIMER_LL_GET_HW(kGroup);
  timer_ll_clear_intr_status(hardware, kAlarm);
  // An alarm takes itself back.
  timer_ll_enable_alarm(hardware, kNumber, true);
  // Alarms that came while this one was held up are lost; the cycle counter still knows them.
  uint32_t missed = 0;
  if (sample_clock.tick(esp_cpu_get_cycle_count(), missed)) {
    static_cast<Device*>(context)->sample(missed);
  }
}

// Whether the driver's timer is the one that the interrupt answers: it shows the count it was
// given.
bool is_ours(gptimer_handle_t handle) {
  constexpr uint64_t kMark = 12345;
  if (gptimer_set_raw_count(handle, kMark) != ESP_OK) return false;
  timer_ll_trigger_soft_capture(TIMER_LL_GET_HW(kGroup), kNumber);
  const bool is_shown = timer_ll_get_counter_value(TIMER_LL_GET_HW(kGroup), kNumber) == kMark;
  return is_shown && gptimer_set_raw_count(handle, 0) == ESP_OK;
}

gptimer_handle_t timer = nullptr;
uint32_t alarm_ticks = 0;
uint32_t carrier_steps = 0;
int tries = 0;

}  // namespace

esp_err_t sample_timer_start(Device& device) {
  gptimer_config_t config{};
  config.clk_src = GPTIMER_CLK_SRC_APB;
  config.direction = GPTIMER_COUNT_UP;
  config.resolution_hz = kTimerHz;
  esp_err_t status = gptimer_new_timer(&config, &timer);
  if (status != ESP_OK) return status;
  if (!is_ours(timer)) return ESP_ERR_NOT_FOUND;
  status = esp_intr_alloc(timer_group_periph_signals.groups[kGroup].timer_irq_id[kNumber],
                          kInterruptFlags, on_alarm, &device, nullptr);
  if (status != ESP_OK) return status;
  timer_ll_enable_intr(TIMER_LL_GET_HW(kGroup), kAlarm, true);

  carrier_steps = 1U << device.config().pwm_bits;
  gptimer_alarm_config_t alarm{};
  alarm_ticks = carrier_steps / 2U * kCarrierPeriodsPerSample;
  alarm.alarm_count = alarm_ticks;
  alarm.reload_count = 0;
  alarm.flags.auto_reload_on_alarm = true;
  const uint32_t cycles_per_sample = alarm_ticks * kCyclesPerTick;
  sample_clock.start(cycles_per_sample, esp_cpu_get_cycle_count() + cycles_per_sample);
  status = gptimer_set_alarm_action(timer, &alarm);
  if (status == ESP_OK) status = gptimer_enable(timer);
  return status == ESP_OK ? gptimer_start(timer) : status;
}

esp_err_t sample_timer_keep_aligned() {
  const uint32_t at = pwm_written_at();
  if (timer == nullptr || at == kNeverWritten) return ESP_OK;
  if (at >= carrier_steps * 3U / 8U && at <= carrier_steps * 7U / 8U) {
    tries = 0;
    return ESP_OK;
  }
  if (tries >= kTries) return ESP_ERR_INVALID_STATE;
  ++tries;
  uint64_t count = 0;
  const esp_err_t status = gptimer_get_raw_count(timer, &count);
  if (status != ESP_OK) return status;
  // The last write stands at five eighths: the first, at sixteen channels less than three eighths
  // before it (docs/device.md), is in the same period, and so is an interrupt that comes a quarter
  // later. Later by so many steps, of which a tick is two; a count that is less comes later.
  const uint32_t wanted = carrier_steps * 5U / 8U;
  const uint32_t later = (wanted + carrier_steps - at) % carrier_steps / 2U;
  const uint32_t moved = (static_cast<uint32_t>(count) + alarm_ticks - later) % alarm_ticks;
  return gptimer_set_raw_count(timer, moved);
}

}  // namespace chladni::chip
