// The chip's own USB: a serial port of class CDC, which the ROM's loader answers on too. The host
// waits while flash is written, so no byte is lost then.
#include "link/wire.hpp"

#include "driver/usb_serial_jtag.h"
#include "freertos/FreeRTOS.h"

namespace chladni::chip {

esp_err_t wire_start() {
  usb_serial_jtag_driver_config_t config{};
  config.rx_buffer_size = kReceiveBytes;
  // A host may not be reading, and the main loop does not wait: what finds no room is dropped.
  config.tx_buffer_size = 4 * kSendBytes;
  return usb_serial_jtag_driver_install(&config);
}

void wire_set_baud(uint32_t) {}

int wire_read(uint8_t* bytes, uint32_t count) {
  return usb_serial_jtag_read_bytes(bytes, count, 0);
}

void wire_write(const void* bytes, size_t count) { usb_serial_jtag_write_bytes(bytes, count, 0); }

}  // namespace chladni::chip
