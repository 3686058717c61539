// The first code after a reset that is ours: gates of the authors' board low, and away from the PWM,
// which a restart of the processor alone does not stop (docs/hardware.md). Other pins than the
// default configuration's are reached when the application starts. It is for a WROOM-32: GPIO 16 and
// 17 are the PSRAM's on a WROVER and the flash's on a PICO-D4, which must be built without it.
#include "soc/gpio_reg.h"
#include "soc/gpio_sig_map.h"
#include "soc/io_mux_reg.h"
#include "soc/soc.h"

#define GATES (BIT(2) | BIT(4) | BIT(15) | BIT(16) | BIT(17))

// The bootloader links this file because it looks for this name.
void bootloader_hooks_include(void) {}

void bootloader_before_init(void) {
  REG_WRITE(GPIO_OUT_W1TC_REG, GATES);
  for (unsigned pin = 0; pin < 32; ++pin) {
    if ((GATES >> pin) & 1U) REG_WRITE(GPIO_FUNC0_OUT_SEL_CFG_REG + 4 * pin, SIG_GPIO_OUT_IDX);
  }
  REG_WRITE(GPIO_ENABLE_W1TS_REG, GATES);
  PIN_FUNC_SELECT(IO_MUX_GPIO2_REG, PIN_FUNC_GPIO);
  PIN_FUNC_SELECT(IO_MUX_GPIO4_REG, PIN_FUNC_GPIO);
  PIN_FUNC_SELECT(IO_MUX_GPIO15_REG, PIN_FUNC_GPIO);
  PIN_FUNC_SELECT(IO_MUX_GPIO16_REG, PIN_FUNC_GPIO);
  PIN_FUNC_SELECT(IO_MUX_GPIO17_REG, PIN_FUNC_GPIO);
}
