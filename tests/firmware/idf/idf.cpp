// The fake's side of idf.hpp. Above each group stands what of ESP-IDF 5.5's documentation (API
// Reference, by chapter) it models.
#include "idf.hpp"

namespace fake {

Chip chip;

esp_err_t call(const char* name) {
  const int count = ++chip.calls[name];
  if (name == chip.crashing) throw Aborted{};
  return name == chip.failing && count == chip.failing_at ? ESP_FAIL : ESP_OK;
}

}  // namespace fake

using fake::call;
using fake::chip;

ledc_dev_t LEDC;

const char* esp_err_to_name(esp_err_t status) { return status == ESP_FAIL ? "ESP_FAIL" : "other"; }

// One timer, as the firmware has.
constexpr uint64_t kCyclesPerTick = 6;
struct gptimer_t {
  uint64_t alarm = 0, offset = 0, held = 0;  // ticks
  bool is_enabled = false, is_running = false;
  uint64_t ticks() const { return chip.cycles / kCyclesPerTick - offset; }
  uint64_t shown() const { return is_running ? ticks() % alarm : held; }
};
static gptimer_t timer;
timg_dev_t TIMERG0;
static intr_handler_t handler = nullptr;
static void* handler_argument = nullptr;

// One that is not cleared would come again at once, for ever.
static void interrupt() {
  TIMERG0.is_armed = false;
  TIMERG0.is_raised = true;
  handler(handler_argument);
  if (TIMERG0.is_raised) throw fake::Misuse("an interrupt that is never cleared");
}

namespace fake {

void Chip::advance(uint64_t count) {
  const uint64_t end = cycles + count;
  const bool is_served = TIMERG0.is_heard && handler != nullptr && !is_interrupt_dead;
  while (timer.is_running && TIMERG0.is_armed && is_served) {
    const uint64_t at =
        (timer.offset + (timer.ticks() / timer.alarm + 1) * timer.alarm) * kCyclesPerTick;
    if (at >= end) break;
    cycles = at + latency;
    latency = 480;  // 2 µs
    first_period.fill(UINT64_MAX);
    interrupt();
    if (must_repeat) interrupt();
    must_repeat = false;
  }
  if (cycles < end) cycles = end;
}

bool Chip::is_on(uint32_t pin) const {
  const Pin& own = pins[pin];
  if (own.channel < 0) return own.is_output && own.level;
  return LEDC.channel_group[own.channel / 8].channel[own.channel % 8].duty_now() > 0;
}

}  // namespace fake

// FreeRTOS: a task that is created may run before the call returns, and answers pdPASS if there was
// memory for it; a task that deletes itself does not come back; a notification ends a wait.
TaskHandle_t xTaskGetCurrentTaskHandle() { return &chip; }
BaseType_t xTaskCreatePinnedToCore(void (*code)(void*), const char*, uint32_t, void* argument,
                                   unsigned, TaskHandle_t*, BaseType_t) {
  if (call("xTaskCreatePinnedToCore") != ESP_OK) return pdFALSE;
  try {
    code(argument);
  } catch (const fake::TaskEnded&) {
  }
  return pdPASS;
}
void xTaskNotifyGive(TaskHandle_t) {}
void vTaskNotifyGiveFromISR(TaskHandle_t, BaseType_t* must_yield) { *must_yield = pdTRUE; }
uint32_t ulTaskNotifyTake(BaseType_t, TickType_t wait) {
  if (wait == portMAX_DELAY) return 1;
  if (chip.turns >= chip.last_turn) throw fake::Stopped{};
  ++chip.turns;
  if (chip.on_turn != nullptr) chip.on_turn(chip.turns);
  chip.advance(240000);
  return 0;
}
void vTaskDelay(TickType_t wait) {
  if (wait == portMAX_DELAY) throw fake::Misuse("the main task sleeps for ever");
  chip.advance(240000ULL * wait);
}
unsigned uxTaskGetStackHighWaterMark(TaskHandle_t) { return 5000; }
void vTaskDelete(TaskHandle_t) { throw fake::TaskEnded{}; }

// Miscellaneous System APIs: shutdown handlers run inside esp_restart, which does not return.
// Watchdogs: a task subscribes itself with a null handle.
esp_reset_reason_t esp_reset_reason() { return chip.reset_reason; }
void esp_restart() {
  if (chip.shutdown != nullptr) chip.shutdown();
  throw fake::Restarted{};
}
esp_err_t esp_register_shutdown_handler(void (*handler)()) {
  const esp_err_t status = call("esp_register_shutdown_handler");
  if (status == ESP_OK) chip.shutdown = handler;
  return status;
}
esp_err_t esp_brownout_register_callback(void (*handler)()) {
  const esp_err_t status = call("esp_brownout_register_callback");
  if (status == ESP_OK) chip.brown_out = handler;
  return status;
}
int64_t esp_timer_get_time() { return static_cast<int64_t>(chip.cycles / 240U); }
esp_err_t esp_task_wdt_add(TaskHandle_t) {
  const esp_err_t status = call("esp_task_wdt_add");
  chip.has_watchdog = status == ESP_OK;
  return status;
}
esp_err_t esp_task_wdt_reset() { return ESP_OK; }
uint32_t esp_cpu_get_cycle_count() { return static_cast<uint32_t>(chip.cycles); }
uint32_t esp_random() { return 4; }

// GPIO & RTC GPIO: GPIO 6 to 11 are the SPI flash's, 34 to 39 inputs only (an S3: 26 to 31, none);
// gpio_set_level may come before the direction. GPIO matrix: a pin follows the peripheral it was
// last routed to.
esp_err_t gpio_config(const gpio_config_t* setting) {
  for (uint32_t pin = 0; pin < static_cast<uint32_t>(fake::kPins); ++pin) {
    if (((setting->pin_bit_mask >> pin) & 1U) == 0) continue;
    if (setting->mode == GPIO_MODE_OUTPUT && pin >= fake::kFirstInput) return ESP_ERR_INVALID_ARG;
    const uint32_t first_of_flash = fake::kGroups == 1 ? 26 : 6;
    if (pin >= first_of_flash && pin < first_of_flash + 6) throw fake::Misuse("the flash's pins");
    if (setting->mode == GPIO_MODE_OUTPUT) {
      chip.pins[pin].is_output = true;
      chip.pins[pin].channel = -1;
    }
  }
  return call("gpio_config");
}
esp_err_t gpio_set_level(gpio_num_t pin, uint32_t level) {
  chip.pins.at(static_cast<size_t>(pin)).level = level != 0;
  return ESP_OK;
}
esp_err_t gpio_set_direction(gpio_num_t pin, int mode) {
  chip.pins.at(static_cast<size_t>(pin)).is_output = mode == GPIO_MODE_OUTPUT;
  return ESP_OK;
}
int gpio_get_level(gpio_num_t) { return chip.is_bus_stuck ? 0 : 1; }
esp_err_t gpio_install_isr_service(int) { return call("gpio_install_isr_service"); }
esp_err_t gpio_isr_handler_add(gpio_num_t, void (*handler)(void*), void* argument) {
  const esp_err_t status = call("gpio_isr_handler_add");
  if (status == ESP_OK) handler(argument);  // the panel calls once, to see that it may
  return status;
}
void REG_WRITE(uint32_t address, uint32_t value) {
  const bool is_high = address == GPIO_OUT1_W1TC_REG || address == GPIO_ENABLE1_W1TS_REG;
  const bool is_set = address == GPIO_OUT_W1TS_REG;
  const bool is_level = is_set || address == GPIO_OUT_W1TC_REG || address == GPIO_OUT1_W1TC_REG;
  const bool is_enable = address == GPIO_ENABLE_W1TS_REG || address == GPIO_ENABLE1_W1TS_REG;
  if (is_level || is_enable) {
    for (uint32_t bit = 0; bit < 32; ++bit) {
      if (((value >> bit) & 1U) == 0) continue;
      fake::Pin& pin = chip.pins.at(bit + (is_high ? 32U : 0U));
      if (is_level) pin.level = is_set;
      if (is_enable) pin.is_output = true;
    }
    return;
  }
  const uint32_t pin = (address - GPIO_FUNC0_OUT_SEL_CFG_REG) / 4U;
  if (value == SIG_GPIO_OUT_IDX) chip.pins.at(pin).channel = -1;
}

// LED Control: frequency and resolution must divide the clock; a channel is routed to its pin when
// it is configured. TRM, LED PWM Controller: a duty is taken over at the overflow after duty_start;
// a low-speed channel's after its update bit as well.
esp_err_t ledc_timer_config(const ledc_timer_config_t* setting) {
  if (setting->freq_hz != 80000000U >> setting->duty_resolution) throw fake::Misuse("carrier");
  const esp_err_t status = call("ledc_timer_config");
  if (status != ESP_OK) return status;
  chip.pwm_steps = 1U << setting->duty_resolution;
  const auto group = static_cast<size_t>(setting->speed_mode);
  chip.cycles += 10007;  // some time in the driver, so that groups start apart
  chip.started[group] = chip.cycles;
  return status;
}
esp_err_t ledc_channel_config(const ledc_channel_config_t* setting) {
  const int pin = setting->gpio_num;
  if (pin < 0 || pin >= static_cast<int>(fake::kFirstInput) || setting->channel > 7)
    return ESP_ERR_INVALID_ARG;
  const esp_err_t status = call("ledc_channel_config");
  if (status == ESP_OK) {
    chip.pins[static_cast<size_t>(pin)].channel = setting->speed_mode * 8 + setting->channel;
  }
  return status;
}
// General Purpose Timer: callbacks are registered before the timer is enabled, which comes before
// it is started; an active timer goes on from a raw count that is set; the alarm comes when the
// count reaches it, and auto-reload arms it again. A count beyond the alarm would wait for the
// overflow.
esp_err_t gptimer_new_timer(const gptimer_config_t* setting, gptimer_handle_t* made) {
  if (setting->resolution_hz != 40000000U) throw fake::Misuse("resolution");
  *made = &timer;
  return call("gptimer_new_timer");
}
esp_err_t gptimer_set_alarm_action(gptimer_handle_t own, const gptimer_alarm_config_t* alarm) {
  own->alarm = alarm->alarm_count;
  TIMERG0.is_armed = true;
  return call("gptimer_set_alarm_action");
}
esp_err_t gptimer_enable(gptimer_handle_t own) {
  const esp_err_t status = call("gptimer_enable");
  own->is_enabled = status == ESP_OK;
  return status;
}
esp_err_t gptimer_start(gptimer_handle_t own) {
  if (!own->is_enabled) throw fake::Misuse("a timer started before it was enabled");
  const esp_err_t status = call("gptimer_start");
  if (status == ESP_OK) {
    own->is_running = true;
    own->offset = chip.cycles / kCyclesPerTick;
  }
  return status;
}
esp_err_t gptimer_get_raw_count(gptimer_handle_t own, uint64_t* count) {
  *count = own->shown();
  chip.cycles += 120;  // half a microsecond for the call
  return call("gptimer_get_raw_count");
}
esp_err_t gptimer_set_raw_count(gptimer_handle_t own, uint64_t count) {
  if (own->is_running && count >= own->alarm) {
    throw fake::Misuse("a count beyond the alarm: it would not come");
  }
  own->offset = chip.cycles / kCyclesPerTick - count;
  own->held = count;
  return call("gptimer_set_raw_count");
}
// The low-level functions: a capture shows the count in the registers.
void timer_ll_trigger_soft_capture(timg_dev_t* own, uint32_t) {
  own->captured = timer.shown() + (chip.is_timer_another ? 1U : 0U);
}

// Interrupt Allocation: a handler that runs with the cache off must say so.
esp_err_t esp_intr_alloc(int source, int flags, intr_handler_t code, void* argument,
                         intr_handle_data_t**) {
  if (source != timer_group_periph_signals.groups[0].timer_irq_id[0]) throw fake::Misuse("source");
  if ((flags & ESP_INTR_FLAG_IRAM) == 0) throw fake::Misuse("an interrupt that flash holds up");
  const esp_err_t status = call("esp_intr_alloc");
  if (status == ESP_OK) {
    handler = code;
    handler_argument = argument;
  }
  return status;
}

// UART: with a transmit buffer uart_write_bytes copies and returns; uart_read_bytes with no wait
// returns what is there.
esp_err_t uart_driver_install(uart_port_t, int, int, int, void*, int) {
  return call("uart_driver_install");
}
esp_err_t uart_param_config(uart_port_t, const uart_config_t*) { return call("uart_param_config"); }
esp_err_t uart_wait_tx_done(uart_port_t, TickType_t) { return ESP_OK; }
esp_err_t uart_set_baudrate(uart_port_t, uint32_t) { return call("uart_set_baudrate"); }
int uart_read_bytes(uart_port_t, void* bytes, uint32_t count, TickType_t) {
  uint32_t taken = 0;
  for (; taken < count && !chip.received.empty(); ++taken) {
    static_cast<uint8_t*>(bytes)[taken] = chip.received.front();
    chip.received.pop_front();
  }
  return static_cast<int>(taken);
}
int uart_write_bytes(uart_port_t, const void* bytes, size_t count) {
  chip.sent.append(static_cast<const char*>(bytes), count);
  return static_cast<int>(count);
}

// USB Serial/JTAG: reads and writes with no wait take and give what there is.
esp_err_t usb_serial_jtag_driver_install(usb_serial_jtag_driver_config_t* setting) {
  if (setting->tx_buffer_size == 0) throw fake::Misuse("a write that waits for the host");
  return call("usb_serial_jtag_driver_install");
}
int usb_serial_jtag_read_bytes(void* bytes, uint32_t count, TickType_t wait) {
  if (wait != 0) throw fake::Misuse("the main loop waits for the wire");
  return uart_read_bytes(UART_NUM_0, bytes, count, 0);
}
int usb_serial_jtag_write_bytes(const void* bytes, size_t count, TickType_t wait) {
  if (wait != 0) throw fake::Misuse("the main loop waits for the wire");
  return uart_write_bytes(UART_NUM_0, bytes, count);
}

// I2C: a transfer that is not acknowledged, or not done in its time, is an error; the bus can be
// reset by nine clocks.
esp_err_t i2c_new_master_bus(const i2c_master_bus_config_t*, i2c_master_bus_handle_t* bus) {
  *bus = &chip;
  return call("i2c_new_master_bus");
}
esp_err_t i2c_master_bus_add_device(i2c_master_bus_handle_t, const i2c_device_config_t*,
                                    i2c_master_dev_handle_t* device) {
  *device = &chip;
  return call("i2c_master_bus_add_device");
}
static esp_err_t transfer(int wait_ms) {
  chip.advance(240000ULL * static_cast<uint64_t>(chip.does_panel_answer ? 0 : wait_ms));
  return chip.does_panel_answer ? ESP_OK : ESP_FAIL;
}
esp_err_t i2c_master_transmit(i2c_master_dev_handle_t, const uint8_t*, size_t, int wait_ms) {
  return transfer(wait_ms);
}
esp_err_t i2c_master_transmit_receive(i2c_master_dev_handle_t, const uint8_t*, size_t,
                                      uint8_t* bytes, size_t count, int wait_ms) {
  std::memset(bytes, 0, count);
  return transfer(wait_ms);
}
esp_err_t i2c_master_bus_reset(i2c_master_bus_handle_t) { return call("i2c_master_bus_reset"); }

// Partitions API: null where none matches; writing turns ones into zeros only; erasing takes whole
// sectors of 4096 bytes; mapped memory shows what is written later.
const esp_partition_t* esp_partition_find_first(esp_partition_type_t, esp_partition_subtype_t,
                                                const char* label) {
  static std::map<std::string, esp_partition_t> found;
  const auto at = chip.flash.find(label);
  if (at == chip.flash.end() || call("esp_partition_find_first") != ESP_OK) return nullptr;
  found[label] = {label, static_cast<uint32_t>(at->second.size())};
  return &found[label];
}
esp_err_t esp_partition_mmap(const esp_partition_t* partition, size_t offset, size_t, int,
                             const void** mapped, esp_partition_mmap_handle_t*) {
  *mapped = chip.flash[partition->label].data() + offset;
  return call("esp_partition_mmap");
}
esp_err_t esp_partition_read(const esp_partition_t* partition, size_t offset, void* bytes,
                             size_t count) {
  std::memcpy(bytes, &chip.flash[partition->label].at(offset), count);
  return call("esp_partition_read");
}
esp_err_t esp_partition_write(const esp_partition_t* partition, size_t offset, const void* bytes,
                              size_t count) {
  std::vector<uint8_t>& own = chip.flash[partition->label];
  for (size_t k = 0; k < count; ++k) own.at(offset + k) &= static_cast<const uint8_t*>(bytes)[k];
  return call("esp_partition_write");
}
esp_err_t esp_partition_erase_range(const esp_partition_t* partition, size_t offset, size_t size) {
  if (offset % 4096 != 0 || size % 4096 != 0) throw fake::Misuse("an erase of part of a sector");
  std::memset(&chip.flash[partition->label].at(offset), 0xFF, size);
  chip.advance(240000ULL * 45U);
  return call("esp_partition_erase_range");
}
