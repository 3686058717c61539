// Chladni on its chip: synthesis alone on core 1, everything else on core 0.
#include <array>
#include <cstdio>
#include <new>

#include "board.hpp"
#include "core/link/console.hpp"
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
#include "sensing/converter.hpp"
#include "storage/flash.hpp"
#include "target.hpp"
#include "touch/panel_bus.hpp"

namespace {

using namespace chladni;

constexpr uint32_t kSetupStackBytes = 4096;
constexpr BaseType_t kSynthesisCore = 1;

// In internal RAM, where the interrupt finds it while the flash cache is off; and in .bss, made in
// place at start: its defaults would else be 20 KB of the image.
alignas(Device) std::array<uint8_t, sizeof(Device)> device_memory;
Device& device = *new (device_memory.data()) Device();
Datagrams datagrams(device);
Link host_link(device, datagrams.state());
TaskHandle_t main_task = nullptr;

// Keeps its content through a restart, a panic and the watchdogs; the reset pin takes it.
RTC_NOINIT_ATTR std::array<uint8_t, kRetainedBytes> retained;

void IRAM_ATTR set_duties(void*, int32_t* duties, uint32_t signs) {
  chip::pwm_set_duties(duties, signs);
}

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
  hal.chip = chip::kChip;
  hal.now_us = [](void*) { return static_cast<uint32_t>(esp_timer_get_time()); };
  hal.set_duties = set_duties;
  hal.cut_outputs = [](void*) { chip::cut_outputs(); };
  hal.retained = [](void*) { return retained.data(); };
  hal.i2c = [](void*, uint8_t address, const uint8_t* written, uint32_t write_count, uint8_t* read,
               uint32_t read_count) {
    return chip::panel_bus_transfer(address, written, write_count, read, read_count);
  };
  hal.recover_bus = [](void*) { chip::panel_bus_recover(); };
  hal.panel_has_called = [](void*) { return chip::panel_has_called(); };
  hal.start_listening = [](void*) { return chip::converter_start(device.config().sense_pin); };
  hal.heard = [](void*, uint16_t* values, uint32_t most) {
    return chip::converter_heard(values, most);
  };
  hal.stop_listening = [](void*) { chip::converter_stop(); };
  hal.open_flash = [](void*) {
    if (!chip::flash_open()) {
      chip::console_print("no room for tables, or no partition named config");
    }
  };
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
  // ESP-IDF counts stacks in bytes.
  hal.stack_free = [](void*) {
    return static_cast<uint32_t>(uxTaskGetStackHighWaterMark(main_task));
  };
  hal.restart = [](void*) {
    // Before what ESP-IDF does on the way down, of which stopping the radio takes a while.
    chip::cut_outputs();
    esp_restart();
  };
  hal.print = [](void*, const char* line) { chip::console_print(line); };
  return hal;
}

// Said on the console, which the link shares: what is missing, and why.
void complain(const char* what, esp_err_t status) {
  chip::console_print(what);
  chip::console_print(esp_err_to_name(status));
}

// Interrupts belong to the core that asks for them.
void set_up_synthesis(void*) {
  esp_err_t status = chip::pwm_start(device.config());
  if (status == ESP_OK) status = chip::sample_timer_start(device);
  if (status != ESP_OK) {
    chip::cut_outputs();
    complain("synthesis did not start:", status);
  } else if (device.config().channels > 8) {
    std::array<char, 64> line{};
    std::snprintf(line.data(), line.size(), "channels 8 and up lag by %d steps of 12.5 ns",
                  static_cast<int>(chip::pwm_group_lag()));
    chip::console_print(line.data());
  }
  xTaskNotifyGive(main_task);
  vTaskDelete(nullptr);
}

// Without it the main loop goes on: it finds that no sample comes, keeps outputs off and answers
// the link, by which another configuration can come.
void start_synthesis() {
  if (xTaskCreatePinnedToCore(set_up_synthesis, "synthesis", kSetupStackBytes, nullptr, 10, nullptr,
                              kSynthesisCore) != pdPASS) {
    complain("synthesis did not start:", ESP_ERR_NO_MEM);
  } else {
    ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
  }
}

// Said once: duties may be taken over a carrier period late, which is heard and does no harm.
void watch_alignment() {
  static bool is_said = false;
  const esp_err_t status = chip::sample_timer_keep_aligned();
  if (status != ESP_OK && !is_said) {
    is_said = true;
    complain("duties are written near the carrier's end:", status);
  }
}

// What cuts the outputs when everything else fails; without it they are not begun.
esp_err_t arm_safety() {
  const esp_err_t status = chip::last_resort_arm();
  return status == ESP_OK ? esp_task_wdt_add(nullptr) : status;
}

// The wire is heard before the radio is tried: what ends a start there must not take both away.
constexpr uint32_t kWireFirstMs = 1000;

// Off, and the radio with it, unless a key was set over the wire.
void start_network() {
  Network network;
  if (!load_network(device.hal(), network)) return;
  if (!device.may_start_network()) {
    chip::console_print("the network stays off after a crash");
    return;
  }
  const esp_err_t status = chip::network_start(network);
  if (status != ESP_OK) {
    complain("the network did not start:", status);
    return;
  }
  datagrams.start();
}

// All but the wire, which answers without it.
void start_all() {
  const esp_err_t safety = arm_safety();
  if (safety == ESP_OK) {
    start_synthesis();
  } else {
    complain("outputs did not start, for want of their last resort:", safety);
  }
  const esp_err_t panel = chip::panel_bus_start(device.config(), main_task);
  if (panel != ESP_OK) complain("the panel's bus did not start:", panel);
}

}  // namespace

extern "C" void app_main() {
  ESP_ERROR_CHECK(chip::console_start());
  main_task = xTaskGetCurrentTaskHandle();
  device.start(make_hal());
  if (!device.is_bare()) {
    chip::gates_low(device.config());
    chip::console_set_baud(device.config().link_baud);
  }
  if (device.is_wire_only()) {
    chip::console_print("crashed again and again: only the wire is started");
  } else {
    start_all();
  }
  // After a turn, so that what keeps outputs off is among it.
  device.poll();
  run_command(device, "info");
  bool is_network_tried = false;
  for (;;) {
    if (!device.is_wire_only()) esp_task_wdt_reset();
    chip::console_poll(host_link);
    chip::network_poll(datagrams);
    device.poll();
    watch_alignment();
    if (!is_network_tried && device.now_ms() >= kWireFirstMs) {
      is_network_tried = true;
      start_network();
    }
    // Until the panel calls, or for a tick, which is a millisecond (sdkconfig.defaults).
    ulTaskNotifyTake(pdTRUE, 1);
  }
}
