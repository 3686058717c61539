#include "link/console.hpp"

#include <array>
#include <cstring>

#include "board.hpp"
#include "driver/uart.h"
#include "freertos/FreeRTOS.h"

namespace chladni::chip {

namespace {

constexpr uart_port_t kPort = UART_NUM_0;
// A frame that comes while a sector is erased, and the one behind it; an answer with the faults.
constexpr int kReceiveBytes = 4096, kSendBytes = 1024;

}  // namespace

esp_err_t console_start() {
  uart_config_t config{};
  config.baud_rate = kConsoleBaud;
  config.data_bits = UART_DATA_8_BITS;
  config.parity = UART_PARITY_DISABLE;
  config.stop_bits = UART_STOP_BITS_1;
  config.flow_ctrl = UART_HW_FLOWCTRL_DISABLE;
  config.source_clk = UART_SCLK_DEFAULT;
  esp_err_t status = uart_driver_install(kPort, kReceiveBytes, kSendBytes, 0, nullptr, 0);
  if (status == ESP_OK) status = uart_param_config(kPort, &config);
  return status;
}

void console_set_baud(uint32_t baud) {
  uart_wait_tx_done(kPort, pdMS_TO_TICKS(100));
  uart_set_baudrate(kPort, baud);
}

void console_poll(Link& link) {
  std::array<uint8_t, 256> bytes{};
  for (;;) {
    const int count = uart_read_bytes(kPort, bytes.data(), bytes.size(), 0);
    if (count <= 0) return;
    link.receive(bytes.data(), static_cast<uint32_t>(count));
  }
}

void console_send(const uint8_t* bytes, uint32_t count) { uart_write_bytes(kPort, bytes, count); }

void console_print(const char* text) {
  uart_write_bytes(kPort, text, std::strlen(text));
  uart_write_bytes(kPort, "\r\n", 2);
}

}  // namespace chladni::chip
