#include "outputs/pwm.hpp"

#include <array>
#include <atomic>

#include "board.hpp"
#include "core/generated/gpio.hpp"
#include "core/storage/config.hpp"
#include "core/synthesis/output_limits.hpp"
#include "driver/gpio.h"
#include "driver/ledc.h"
#include "esp_attr.h"
#include "freertos/FreeRTOS.h"
#include "soc/gpio_reg.h"
#include "soc/gpio_sig_map.h"
#include "soc/ledc_reg.h"
#include "soc/ledc_struct.h"
#include "soc/soc.h"
#include "target.hpp"

namespace chladni::chip {

namespace {

// Channels of a group share one timer, so that their phases hold; the groups' timers run from the
// same clock. All take a duty over at the end of a carrier period, low-speed ones after a further
// command.
constexpr ledc_timer_t kTimer = LEDC_TIMER_0;
constexpr uint32_t kClockHz = 80000000;
constexpr uint32_t kPerGroup = 8;
// A duty's register has sixteenths of a step.
constexpr uint32_t kDutyFractionBits = 4;
// Steps of 12.5 ns by which the groups may be apart: a 64th of a carrier period of 10 bits.
constexpr int32_t kMostLag = 16;

// Read by the interrupt, and by what runs when everything else is lost.
DRAM_ATTR uint32_t channels = 0;
DRAM_ATTR uint32_t first_channels = 0;
DRAM_ATTR uint64_t gates = 0;
// With bridges: all sign pins, as bits of GPIO 0 to 31.
DRAM_ATTR uint32_t all_signs = 0;
// What a channel is told so that it takes its duty over, and a low-speed one so that it hears of
// it: the register's other bits stay as the driver set them. Made once, so that the interrupt
// stores whole words and reads none back but `conf1`.
struct ChannelWords {
  uint32_t start;
  uint32_t update;
  uint32_t sign_pin;  // its bit
};
DRAM_ATTR std::array<ChannelWords, kMaxChannels> words{};
// Written by the interrupt alone.
DRAM_ATTR std::atomic<uint32_t> dropped{0};
DRAM_ATTR std::atomic<uint32_t> written_at{kNeverWritten};
int32_t group_lag = 0;
portMUX_TYPE start_lock = portMUX_INITIALIZER_UNLOCKED;

template <typename Pins>
uint64_t pins_of(const Pins& numbers, uint32_t count) {
  uint64_t pins = 0;
  for (uint32_t k = 0; k < count; ++k) {
    if (numbers[k] < GPIO_NUM_MAX) pins |= 1ULL << numbers[k];
  }
  return pins;
}

esp_err_t start_timer(ledc_mode_t mode, uint32_t pwm_bits) {
  ledc_timer_config_t timer{};
  timer.speed_mode = mode;
  timer.duty_resolution = static_cast<ledc_timer_bit_t>(pwm_bits);
  timer.timer_num = kTimer;
  timer.freq_hz = kClockHz >> pwm_bits;
  timer.clk_cfg = LEDC_USE_APB_CLK;
  return ledc_timer_config(&timer);
}

// Each timer was started by itself; from here on they are as far apart as two writes to registers.
// Never inlined: in flash a cache miss would stand between the writes, and reading a register takes
// longer than the bound allows. So both words of both timers are there before.
[[gnu::noinline]] void IRAM_ATTR start_together() {
  auto& fast = LEDC.timer_group[kLedcGroups.front()].timer[kTimer];
  auto& slow = LEDC.timer_group[kLedcGroups.back()].timer[kTimer];
  const uint32_t fast_runs = fast.conf.val & ~LEDC_LSTIMER0_RST;
  const uint32_t slow_runs = slow.conf.val & ~LEDC_LSTIMER0_RST;
  portENTER_CRITICAL(&start_lock);
  fast.conf.val = fast_runs | LEDC_LSTIMER0_RST;
  slow.conf.val = slow_runs | LEDC_LSTIMER0_RST;
  fast.conf.val = fast_runs;
  slow.conf.val = slow_runs;
  // A read takes as long as the one before: the mean of the fast timer's two is where it stood when
  // the slow one was read.
  const uint32_t before = fast.value.timer_cnt;
  const uint32_t slow_at = slow.value.timer_cnt;
  const uint32_t after = fast.value.timer_cnt;
  portEXIT_CRITICAL(&start_lock);
  group_lag = static_cast<int32_t>((before + after) / 2U) - static_cast<int32_t>(slow_at);
}

}  // namespace

void gates_low(const Config& config) {
  gates = pins_of(config.pwm_pins, config.channels);
  if (gates == 0) return;
  const bool has_bridges = config.driver == kBridge;
  all_signs = has_bridges ? static_cast<uint32_t>(pins_of(config.sign_pins, config.channels)) : 0U;
  const uint64_t low = gates | all_signs;
  // The level first: the register may still hold a 1 from before a software reset.
  for (uint32_t pin = 0; pin < GPIO_NUM_MAX; ++pin) {
    if (((low >> pin) & 1U) != 0) gpio_set_level(static_cast<gpio_num_t>(pin), 0);
  }
  for (uint32_t k = 0; k < config.channels; ++k) {
    words[k].sign_pin = 1U << (config.sign_pins[k] & 31U);
  }
  gpio_config_t setting{};
  setting.pin_bit_mask = low;
  setting.mode = GPIO_MODE_OUTPUT;
  setting.pull_up_en = GPIO_PULLUP_DISABLE;
  setting.pull_down_en = GPIO_PULLDOWN_ENABLE;
  setting.intr_type = GPIO_INTR_DISABLE;
  gpio_config(&setting);
}

esp_err_t pwm_start(const Config& config) {
  // Before it is configured a device has no pins at all, and plays nothing.
  const uint32_t wired = config.pwm_pins[0] == gpio::kNotWired ? 0U : config.channels;
  const bool has_both = wired > kPerGroup;  // never where there is one group: gpio::kAbilities
  esp_err_t status = start_timer(kLedcGroups.front(), config.pwm_bits);
  if (status == ESP_OK && has_both) status = start_timer(kLedcGroups.back(), config.pwm_bits);
  if (status == ESP_OK && has_both) {
    start_together();
    const bool is_near = group_lag <= kMostLag && group_lag >= -kMostLag;
    if (!is_near) status = ESP_ERR_INVALID_STATE;
  }
  for (uint32_t k = 0; k < wired && status == ESP_OK; ++k) {
    ledc_channel_config_t channel{};
    channel.gpio_num = config.pwm_pins[k];
    channel.speed_mode = kLedcGroups[k / kPerGroup];
    channel.channel = static_cast<ledc_channel_t>(k % kPerGroup);
    channel.timer_sel = kTimer;
    channel.duty = 0;
    channel.hpoint = 0;
    status = ledc_channel_config(&channel);
  }
  if (status == ESP_OK) {
    for (uint32_t k = 0; k < wired; ++k) {
      auto& own = LEDC.channel_group[k / kPerGroup].channel[k % kPerGroup];
      words[k].start = own.conf1.val | LEDC_DUTY_START_LSCH0;
      words[k].update = own.conf0.val | LEDC_PARA_UP_LSCH0;
    }
    channels = wired;
    first_channels = has_both ? kPerGroup : channels;
  }
  return status;
}

namespace {

// Channels from `begin` on, all of a group. The driver's own calls take a spinlock and live in
// flash, and ledc_ll_set_duty_start waits for the last duty to be taken over: so look first, and
// never wait. What is still to be taken stands in place of a new duty. Returns the sign pins of
// such channels.
template <ledc_mode_t kMode>
[[gnu::always_inline]] inline uint32_t write_group(int32_t* duties, uint32_t begin, uint32_t end) {
  uint32_t kept = 0;
  auto* own = &LEDC.channel_group[kMode].channel[0];
  const ChannelWords* const last = words.data() + end;
  int32_t* duty = duties + begin;
  for (const ChannelWords* word = words.data() + begin; word < last; ++word, ++own, ++duty) {
    if ((own->conf1.val & LEDC_DUTY_START_LSCH0) != 0) {
      dropped.store(dropped.load(std::memory_order_relaxed) + 1U, std::memory_order_relaxed);
      *duty = static_cast<int32_t>(own->duty.val >> kDutyFractionBits);
      kept |= word->sign_pin;
      continue;
    }
    own->duty.val = static_cast<uint32_t>(*duty) << kDutyFractionBits;
    own->conf1.val = word->start;
    if (kMode == LEDC_LOW_SPEED_MODE) own->conf0.val = word->update;
  }
  return kept;
}

}  // namespace

void IRAM_ATTR pwm_set_duties(int32_t* duties, uint32_t signs) {
  const uint32_t kept = write_group<kLedcGroups.front()>(duties, 0, first_channels);
  if (all_signs != 0) {
    // Bridges, all in the first group: all signs by one write each. A sign pin keeps its level with
    // the duty that it belongs to.
    const uint32_t high = signs & ~kept;
    REG_WRITE(GPIO_OUT_W1TS_REG, high);
    REG_WRITE(GPIO_OUT_W1TC_REG, all_signs ^ kept ^ high);
  } else if (kLedcGroups.size() > 1 && channels > kPerGroup) {
    write_group<kLedcGroups.back()>(duties, kPerGroup, channels);
  }
  written_at.store(pwm_position(), std::memory_order_relaxed);
}

uint32_t pwm_written_at() { return written_at.exchange(kNeverWritten, std::memory_order_relaxed); }

int32_t pwm_group_lag() { return group_lag; }

uint32_t pwm_dropped() { return dropped.load(std::memory_order_relaxed); }

uint32_t IRAM_ATTR pwm_position() {
  return LEDC.timer_group[kLedcGroups.front()].timer[kTimer].value.timer_cnt;
}

void IRAM_ATTR cut_outputs() {
  // The interrupt on the other core may go on writing duties: what it writes must lead nowhere.
  REG_WRITE(GPIO_OUT_W1TC_REG, static_cast<uint32_t>(gates));
  REG_WRITE(GPIO_OUT1_W1TC_REG, static_cast<uint32_t>(gates >> 32));
  for (uint32_t pin = 0; pin < GPIO_NUM_MAX; ++pin) {
    if (((gates >> pin) & 1U) != 0) {
      REG_WRITE(GPIO_FUNC0_OUT_SEL_CFG_REG + 4U * pin, SIG_GPIO_OUT_IDX);
    }
  }
  REG_WRITE(GPIO_ENABLE_W1TS_REG, static_cast<uint32_t>(gates));
  REG_WRITE(GPIO_ENABLE1_W1TS_REG, static_cast<uint32_t>(gates >> 32));
}

}  // namespace chladni::chip
