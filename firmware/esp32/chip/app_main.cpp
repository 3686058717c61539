// Chladni on an ESP32: synthesis alone on core 1, everything else on core 0.
#include "board.hpp"
#include "console.hpp"
#include "core/device.hpp"
#include "esp_attr.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"
#include "pwm.hpp"
#include "sample_timer.hpp"
#include "table_partition.hpp"

namespace {

using namespace chladni;

constexpr uint32_t kSetupStackBytes = 4096;
constexpr BaseType_t kSynthesisCore = 1;

// In internal RAM (.bss), where the interrupt finds it while the flash cache is off.
Device device;
TaskHandle_t main_task = nullptr;
bool is_synthesis_running = false;  // written before the notification that main_task waits for

void IRAM_ATTR set_duty(void*, uint32_t channel, uint32_t duty_steps) {
  chip::pwm_set_duty(channel, duty_steps);
}

Hal make_hal() {
  Hal hal{};
  hal.now_us = [](void*) { return static_cast<uint32_t>(esp_timer_get_time()); };
  hal.set_duty = set_duty;
  // A touch comes over the console until a panel is fitted.
  hal.poll_touch = [](void*, Place*) { return Touch::kNothingNew; };
  hal.read_table = [](void*, uint32_t offset, uint8_t* bytes, uint32_t count) {
    return chip::table_partition_read(offset, bytes, count);
  };
  hal.print = [](void*, const char* line) { chip::console_print(line); };
  return hal;
}

// Interrupts belong to the core that asks for them.
void set_up_synthesis(void*) {
  esp_err_t status = chip::pwm_start();
  if (status == ESP_OK) status = chip::sample_timer_start(device);
  is_synthesis_running = status == ESP_OK;
  if (!is_synthesis_running) {
    chip::gates_low();
    chip::console_print("synthesis did not start:");
    chip::console_print(esp_err_to_name(status));
  }
  xTaskNotifyGive(main_task);
  vTaskDelete(nullptr);
}

}  // namespace

extern "C" void app_main() {
  chip::gates_low();
  ESP_ERROR_CHECK(chip::console_start());
  if (!chip::table_partition_open()) chip::console_print("no partition named tables");
  device.start(make_hal(), chip::kSettings);
  main_task = xTaskGetCurrentTaskHandle();
  if (xTaskCreatePinnedToCore(set_up_synthesis, "synthesis", kSetupStackBytes, nullptr, 10, nullptr,
                              kSynthesisCore) != pdPASS) {
    chip::console_print("no memory for the synthesis task");
  } else {
    ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
  }
  // Without its interrupt the device must not answer touches; the console says why above.
  while (!is_synthesis_running) vTaskDelay(portMAX_DELAY);
  device.command("info");
  for (;;) {
    chip::console_poll(device);
    device.poll();
    vTaskDelay(1);  // one tick is a millisecond (sdkconfig.defaults)
  }
}
