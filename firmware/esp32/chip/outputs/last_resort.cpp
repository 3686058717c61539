#include "outputs/last_resort.hpp"

#include "esp_attr.h"
#include "esp_brownout.h"
#include "esp_private/panic_internal.h"
#include "esp_system.h"
#include "outputs/pwm.hpp"

// ESP-IDF declares this function nowhere; the linker leads every call to the one below.
extern "C" void __real_esp_panic_handler(panic_info_t* info);
extern "C" void __wrap_esp_panic_handler(panic_info_t* info);

extern "C" void IRAM_ATTR __wrap_esp_panic_handler(panic_info_t* info) {
  chladni::chip::cut_outputs();
  __real_esp_panic_handler(info);
}

namespace chladni::chip {

esp_err_t last_resort_arm() {
  const esp_err_t status = esp_register_shutdown_handler(cut_outputs);
  return status == ESP_OK ? esp_brownout_register_callback(cut_outputs) : status;
}

}  // namespace chladni::chip
