// The chip layer's writes of five duties on another processor, with switches and with bridges, for
// tools/instruction_counts.py: how many instructions they take, and what then stands in the
// registers.
#include "core/storage/config.hpp"
#include "outputs/pwm.hpp"
#include "qemu/idf/registers.hpp"
#include "qemu/runtime.hpp"

namespace {

constexpr uint32_t kChannels = 5;

void count(bool has_bridges, const char* begins) {
  chladni::Config config{};
  config.channels = kChannels;
  config.pwm_bits = 10;
  config.pwm_pins = {4, 5, 12, 13, 14};  // any gates will do
  if (has_bridges) {
    config.driver = chladni::kBridge;
    config.sign_pins = {18, 19, 23, 25, 26};
  }
  chladni::chip::gates_low(config);
  chladni::chip::pwm_start(config);
  uint32_t most = 0;
  // Every mixture of signs; one duty is 0.
  for (uint32_t mixture = 0; mixture < 1U << kChannels; ++mixture) {
    int32_t duties[kChannels];
    uint32_t signs = 0;
    for (uint32_t k = 0; k < kChannels; ++k) {
      duties[k] = static_cast<int32_t>(k * 100U);
      if (has_bridges && ((mixture >> k) & 1U) != 0) signs |= 1U << config.sign_pins[k];
      LEDC.channel_group[0].channel[k].conf1.val = 0;  // the last duty was taken over
    }
    const uint32_t nothing = counter();
    const uint32_t begin = counter();
    chladni::chip::pwm_set_duties(duties, signs);
    const uint32_t taken = counter() - begin - (begin - nothing);
    if (taken > most) most = taken;
  }
  say("writes", most, begins);
  say("last_duty", LEDC.channel_group[0].channel[kChannels - 1].duty.val, begins);
  say("high", gpio_registers[GPIO_OUT_W1TS_REG / 4U], begins);
  say("low", gpio_registers[GPIO_OUT_W1TC_REG / 4U], begins);
}

}  // namespace

int main() {
  count(false, "");
  count(true, "bridge_");
  return 0;
}
