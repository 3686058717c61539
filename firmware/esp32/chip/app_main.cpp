// Chladni on an ESP32: synthesis alone on core 1, everything else on core 0.
#include "board.hpp"
#include "core/link/link.hpp"
#include "core/link/udp.hpp"
#include "esp_attr.h"
#include "esp_system.h"
#include "esp_task_wdt.h"
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"
#include "link/console.hpp"
#include "link/network.hpp"
#include "outputs/last_resort.hpp"
#include "outputs/pwm.hpp"
#include "outputs/sample_timer.hpp"
#include "storage/flash.hpp"
#include "touch/panel_bus.hpp"

namespace {

using namespace chladni;

constexpr uint32_t kSetupStackBytes = 4096;
constexpr BaseType_t kSynthesisCore = 1;

// In internal RAM (.bss), where the interrupt finds it while the flash cache is off.
Device device;
Link host_link(device);
Datagrams datagrams(device);
TaskHandle_t main_task = nullptr;
bool is_synthesis_running = false;  // written before the notification that main_task waits for

void IRAM_ATTR set_duties(void*, const uint32_t* duties) { chip::pwm_set_duties(duties); }

ResetCause reset_cause(void*) {
  switch (esp_reset_reason()) {
    case ESP_RST_POWERON: return ResetCause::kPowerOn;
    case ESP_RST_SW: return ResetCause::kSoftware;
    case ESP_RST_PANIC: return ResetCause::kPanic;
    case ESP_RST_INT_WDT:
    case ESP_RST_TASK_WDT:
    case ESP_RST_WDT: return ResetCause::kWatchdog;
    case ESP_RST_BROWNOUT: return ResetCause::kBrownOut;
    default: return ResetCause::kOther;
  }
}

Hal make_hal() {
  Hal hal{};
  hal.now_us = [](void*) { return static_cast<uint32_t>(esp_timer_get_time()); };
  hal.set_duties = set_duties;
  hal.cut_outputs = [](void*) { chip::cut_outputs(); };
  hal.i2c = [](void*, uint8_t address, const uint8_t* written, uint32_t write_count, uint8_t* read,
               uint32_t read_count) {
    return chip::panel_bus_transfer(address, written, write_count, read, read_count);
  };
  hal.recover_bus = [](void*) { chip::panel_bus_recover(); };
  hal.panel_has_called = [](void*) { return chip::panel_has_called(); };
  hal.read_flash = [](void*, FlashArea area, uint32_t offset, uint8_t* bytes, uint32_t count) {
    return chip::flash_read(area, offset, bytes, count);
  };
  hal.map_flash = [](void*, FlashArea area, uint32_t offset, uint32_t count) {
    return chip::flash_map(area, offset, count);
  };
  hal.erase_sector = [](void*, FlashArea area, uint32_t offset) {
    return chip::flash_erase_sector(area, offset);
  };
  hal.program_flash = [](void*, FlashArea area, uint32_t offset, const uint8_t* bytes,
                         uint32_t count) {
    return chip::flash_program(area, offset, bytes, count);
  };
  hal.reset_cause = reset_cause;
  hal.send = [](void*, const uint8_t* bytes, uint32_t count) { chip::console_send(bytes, count); };
  hal.send_datagram = [](void*, const uint8_t* bytes, uint32_t count) {
    chip::network_send(bytes, count);
  };
  hal.hmac_sha256 = [](void*, const uint8_t* key, const uint8_t* bytes, uint32_t count,
                       uint8_t* mac) { return chip::network_hmac(key, bytes, count, mac); };
  hal.random = [](void*) { return chip::network_random(); };
  hal.restart = [](void*) {
    // Before what ESP-IDF does on the way down, of which stopping the radio takes a while.
    chip::cut_outputs();
    esp_restart();
  };
  hal.print = [](void*, const char* line) { chip::console_print(line); };
  return hal;
}

// Interrupts belong to the core that asks for them.
void set_up_synthesis(void*) {
  esp_err_t status = chip::pwm_start(device.config());
  if (status == ESP_OK) status = chip::sample_timer_start(device);
  is_synthesis_running = status == ESP_OK;
  if (!is_synthesis_running) {
    chip::cut_outputs();
    chip::console_print("synthesis did not start:");
    chip::console_print(esp_err_to_name(status));
  }
  xTaskNotifyGive(main_task);
  vTaskDelete(nullptr);
}

void start_synthesis() {
  main_task = xTaskGetCurrentTaskHandle();
  if (xTaskCreatePinnedToCore(set_up_synthesis, "synthesis", kSetupStackBytes, nullptr, 10, nullptr,
                              kSynthesisCore) != pdPASS) {
    chip::console_print("no memory for the synthesis task");
  } else {
    ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
  }
  // Without it the main loop goes on: it finds that no sample comes, keeps outputs off and answers
  // the link, by which another configuration can come.
}

// Off, and the radio with it, unless a key was set over the wire.
void start_network() {
  Network network;
  if (!load_network(make_hal(), network)) return;
  const esp_err_t status = chip::network_start(network, device.network());
  if (status != ESP_OK) {
    chip::console_print("the network did not start:");
    chip::console_print(esp_err_to_name(status));
    return;
  }
  datagrams.start(make_hal());
}

}  // namespace

extern "C" void app_main() {
  chip::gates_low(Config{});
  ESP_ERROR_CHECK(chip::console_start());
  ESP_ERROR_CHECK(chip::last_resort_arm());
  if (!chip::flash_open()) chip::console_print("no room for tables, or no partition named config");
  device.start(make_hal());
  chip::gates_low(device.config());
  chip::console_set_baud(device.config().link_baud);
  start_synthesis();
  const esp_err_t panel = chip::panel_bus_start(device.config(), main_task);
  if (panel != ESP_OK) {
    chip::console_print("the panel's bus did not start:");
    chip::console_print(esp_err_to_name(panel));
  }
  start_network();
  ESP_ERROR_CHECK(esp_task_wdt_add(nullptr));
  device.command("info");
  for (;;) {
    esp_task_wdt_reset();
    chip::console_poll(host_link);
    chip::network_poll(datagrams, device.network());
    device.poll();
    // Until the panel calls, or for a tick, which is a millisecond (sdkconfig.defaults).
    ulTaskNotifyTake(pdTRUE, 1);
  }
}
