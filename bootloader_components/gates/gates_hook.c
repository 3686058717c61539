// The first code after a reset that is ours: the gates of `prototype` low, and away from the PWM,
// which a restart of the processor alone does not stop (docs/hardware.md). Another board's gates are
// reached when the application has read its configuration. It is for a WROOM-32: GPIO 16 and 17 are
// the PSRAM's on a WROVER and the flash's on a PICO-D4, which must be built without it.
#include "gates.h"
#include "soc/gpio_reg.h"
#include "soc/gpio_sig_map.h"

// The bootloader links this file because it looks for this name.
void bootloader_hooks_include(void) {}

void bootloader_before_init(void) {
  REG_WRITE(GPIO_OUT_W1TC_REG, GATES);
  for (unsigned pin = 0; pin < 32; ++pin) {
    if ((GATES >> pin) & 1U) REG_WRITE(GPIO_FUNC0_OUT_SEL_CFG_REG + 4 * pin, SIG_GPIO_OUT_IDX);
  }
  REG_WRITE(GPIO_ENABLE_W1TS_REG, GATES);
  select_gpio_for_gates();
}
