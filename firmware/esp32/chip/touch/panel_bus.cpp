#include "touch/panel_bus.hpp"

#include <array>
#include <atomic>

#include "board.hpp"
#include "core/sensing/accelerometer.hpp"
#include "core/sensing/expander.hpp"
#include "core/touch/panel.hpp"
#include "driver/gpio.h"
#include "driver/i2c_master.h"
#include "esp_attr.h"

namespace chladni::chip {

namespace {

// The longest transfer reads all ten fingers that a GT911 may list, 85 bytes with addresses and
// register: 765 bits of the bus's clock, and some more. The rest is for tasks.
constexpr uint32_t kLongestBits = 850;
constexpr uint32_t kSpareMs = 4;
constexpr uint32_t kResetMs = 10, kStartMs = 60;
constexpr std::array<uint8_t, 8> kAddresses = {
    0x38,
    gt911::kAddresses[0],
    gt911::kAddresses[1],
    expander::kAddress,
    Accelerometer::kAddresses[0],
    Accelerometer::kAddresses[1],
    Accelerometer::kAddresses[2],
    Accelerometer::kAddresses[3],
};

i2c_master_bus_handle_t bus = nullptr;
std::array<i2c_master_dev_handle_t, kAddresses.size()> devices{};
gpio_num_t data_pin = GPIO_NUM_NC;
int timeout_ms = 0;
TaskHandle_t woken_task = nullptr;
std::atomic<bool> has_called{false};

void IRAM_ATTR on_call(void*) {
  has_called.store(true, std::memory_order_release);
  BaseType_t must_yield = pdFALSE;
  vTaskNotifyGiveFromISR(woken_task, &must_yield);
  portYIELD_FROM_ISR(must_yield);
}

esp_err_t start_bus(const Config& config) {
  i2c_master_bus_config_t setting{};
  setting.i2c_port = I2C_NUM_0;
  setting.sda_io_num = static_cast<gpio_num_t>(config.sda_pin);
  setting.scl_io_num = static_cast<gpio_num_t>(config.scl_pin);
  setting.clk_source = I2C_CLK_SRC_DEFAULT;
  setting.glitch_ignore_cnt = 7;
  setting.flags.enable_internal_pullup = true;
  esp_err_t status = i2c_new_master_bus(&setting, &bus);
  for (size_t k = 0; k < kAddresses.size() && status == ESP_OK; ++k) {
    i2c_device_config_t device{};
    device.dev_addr_length = I2C_ADDR_BIT_LEN_7;
    device.device_address = kAddresses[k];
    device.scl_speed_hz = config.i2c_khz * 1000U;
    status = i2c_master_bus_add_device(bus, &device, &devices[k]);
  }
  return status;
}

// A GT911 takes its address from the interrupt line's level at this moment; both are asked later.
void reset_panel(const Config& config) {
  if (config.reset_pin == kNotWired) return;
  const auto pin = static_cast<gpio_num_t>(config.reset_pin);
  gpio_set_level(pin, 0);
  gpio_set_direction(pin, GPIO_MODE_OUTPUT);
  vTaskDelay(pdMS_TO_TICKS(kResetMs));
  gpio_set_level(pin, 1);
  vTaskDelay(pdMS_TO_TICKS(kStartMs));
}

esp_err_t start_line(const Config& config) {
  if (config.interrupt_pin == kNotWired) return ESP_OK;
  if (config.interrupt_pin >= GPIO_NUM_MAX) return ESP_ERR_INVALID_ARG;
  const auto pin = static_cast<gpio_num_t>(config.interrupt_pin);
  gpio_config_t setting{};
  setting.pin_bit_mask = 1ULL << config.interrupt_pin;
  setting.mode = GPIO_MODE_INPUT;
  setting.pull_up_en = GPIO_PULLUP_DISABLE;  // GPIO 34 to 39 have none, and panels drive the line
  setting.pull_down_en = GPIO_PULLDOWN_DISABLE;
  setting.intr_type = GPIO_INTR_NEGEDGE;
  esp_err_t status = gpio_config(&setting);
  if (status == ESP_OK) status = gpio_install_isr_service(0);
  return status == ESP_OK ? gpio_isr_handler_add(pin, on_call, nullptr) : status;
}

}  // namespace

esp_err_t panel_bus_start(const Config& config, TaskHandle_t woken) {
  if (config.panel == 0) return ESP_OK;
  woken_task = woken;
  data_pin = static_cast<gpio_num_t>(config.sda_pin);
  timeout_ms = static_cast<int>(kSpareMs + (kLongestBits + config.i2c_khz - 1U) / config.i2c_khz);
  reset_panel(config);
  const esp_err_t status = start_bus(config);
  return status == ESP_OK ? start_line(config) : status;
}

BusStatus panel_bus_transfer(uint8_t address, const uint8_t* written, uint32_t write_count,
                             uint8_t* read, uint32_t read_count) {
  for (size_t k = 0; k < kAddresses.size(); ++k) {
    if (kAddresses[k] != address || devices[k] == nullptr) continue;
    const esp_err_t status =
        read_count > 0 ? i2c_master_transmit_receive(devices[k], written, write_count, read,
                                                     read_count, timeout_ms)
                       : i2c_master_transmit(devices[k], written, write_count, timeout_ms);
    if (status == ESP_OK) return BusStatus::kOk;
    // The driver does not tell a missing answer from a held line; the line itself does.
    return gpio_get_level(data_pin) == 0 ? BusStatus::kStuck : BusStatus::kNoAnswer;
  }
  return BusStatus::kNoAnswer;
}

void panel_bus_recover() {
  if (bus != nullptr) i2c_master_bus_reset(bus);
}

bool panel_has_called() { return has_called.exchange(false, std::memory_order_acquire); }

}  // namespace chladni::chip
