#include "link/console.hpp"

#include <array>
#include <cstring>

#include "link/wire.hpp"

namespace chladni::chip {

esp_err_t console_start() { return wire_start(); }

void console_set_baud(uint32_t baud) { wire_set_baud(baud); }

void console_poll(Link& link) {
  std::array<uint8_t, 256> bytes{};
  for (;;) {
    const int count = wire_read(bytes.data(), bytes.size());
    if (count <= 0) return;
    link.receive(bytes.data(), static_cast<uint32_t>(count));
  }
}

void console_send(const uint8_t* bytes, uint32_t count) { wire_write(bytes, count); }

void console_print(const char* text) {
  wire_write(text, std::strlen(text));
  wire_write("\r\n", 2);
}

}  // namespace chladni::chip
