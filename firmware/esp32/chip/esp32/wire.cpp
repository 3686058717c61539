// UART0, by a bridge to USB.
#include "link/wire.hpp"

#include "board.hpp"
#include "driver/uart.h"
#include "freertos/FreeRTOS.h"

namespace chladni::chip {

namespace {

constexpr uart_port_t kPort = UART_NUM_0;

}  // namespace

esp_err_t wire_start() {
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

void wire_set_baud(uint32_t baud) {
  uart_wait_tx_done(kPort, pdMS_TO_TICKS(100));
  uart_set_baudrate(kPort, baud);
}

int wire_read(uint8_t* bytes, uint32_t count) { return uart_read_bytes(kPort, bytes, count, 0); }

void wire_write(const void* bytes, size_t count) { uart_write_bytes(kPort, bytes, count); }

}  // namespace chladni::chip
