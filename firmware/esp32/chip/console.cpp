#include "console.hpp"

#include <array>
#include <cstring>

#include "board.hpp"
#include "driver/uart.h"

namespace chladni::chip {

namespace {

constexpr uart_port_t kPort = UART_NUM_0;
constexpr int kReceiveBytes = 512;

std::array<char, 80> line{};
size_t length = 0;
bool is_overlong = false;

void take(Device& device, char c) {
  if (c != '\n' && c != '\r') {
    if (length + 1 < line.size()) {
      line[length++] = c;
    } else {
      is_overlong = true;
    }
    return;
  }
  line[length] = '\0';
  // A line that did not fit is answered like any other that makes no sense.
  if (length > 0) device.command(is_overlong ? "?" : line.data());
  length = 0;
  is_overlong = false;
}

}  // namespace

esp_err_t console_start() {
  uart_config_t config{};
  config.baud_rate = kConsoleBaud;
  config.data_bits = UART_DATA_8_BITS;
  config.parity = UART_PARITY_DISABLE;
  config.stop_bits = UART_STOP_BITS_1;
  config.flow_ctrl = UART_HW_FLOWCTRL_DISABLE;
  config.source_clk = UART_SCLK_DEFAULT;
  esp_err_t status = uart_driver_install(kPort, kReceiveBytes, 0, 0, nullptr, 0);
  if (status == ESP_OK) status = uart_param_config(kPort, &config);
  return status;
}

void console_poll(Device& device) {
  std::array<char, 64> bytes{};
  const int count = uart_read_bytes(kPort, bytes.data(), bytes.size(), 0);
  for (int k = 0; k < count; ++k) take(device, bytes[static_cast<size_t>(k)]);
}

void console_print(const char* text) {
  uart_write_bytes(kPort, text, std::strlen(text));
  uart_write_bytes(kPort, "\r\n", 2);
}

}  // namespace chladni::chip
