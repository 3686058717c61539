// A small fake of the ESP-IDF 5.5.3 calls that chip/ uses, stricter than the real thing.
//
// An alarm comes when the timer reaches its count and is armed again by the reload. Any call can be
// made to fail, the k-th time it is made. What it leaves out: interrupt priorities, caches, the
// radio, and the time that calls take.
#pragma once

#include "fake_chip.hpp"

const char* esp_err_to_name(esp_err_t status);

// Named as ESP-IDF names it, so that an object file shows what would lie there.
#define IRAM_ATTR __attribute__((section(".iram1")))
#define DRAM_ATTR
// What RTC memory holds after a start is up to the scenario.
#define RTC_NOINIT_ATTR __attribute__((section("rtc_noinit")))

#define ESP_ERROR_CHECK(x)                    \
  do {                                        \
    if ((x) != ESP_OK) throw fake::Aborted{}; \
  } while (0)

// FreeRTOS
using BaseType_t = int;
using TickType_t = uint32_t;
using TaskHandle_t = void*;
constexpr BaseType_t pdTRUE = 1, pdFALSE = 0, pdPASS = 1;
constexpr TickType_t portMAX_DELAY = 0xFFFFFFFFU;
constexpr TickType_t pdMS_TO_TICKS(uint32_t ms) { return ms; }
#define portYIELD_FROM_ISR(x) (void)(x)
struct portMUX_TYPE {};
#define portMUX_INITIALIZER_UNLOCKED \
  {                                  \
  }
#define portENTER_CRITICAL(lock) (void)(lock)
#define portEXIT_CRITICAL(lock) (void)(lock)
TaskHandle_t xTaskGetCurrentTaskHandle();
BaseType_t xTaskCreatePinnedToCore(void (*code)(void*), const char* name, uint32_t stack,
                                   void* argument, unsigned priority, TaskHandle_t* task,
                                   BaseType_t core);
void xTaskNotifyGive(TaskHandle_t task);
void vTaskNotifyGiveFromISR(TaskHandle_t task, BaseType_t* must_yield);
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks);
void vTaskDelay(TickType_t ticks);
void vTaskDelete(TaskHandle_t task);
unsigned uxTaskGetStackHighWaterMark(TaskHandle_t task);

// System
using esp_reset_reason_t = int;
constexpr int ESP_RST_POWERON = 1, ESP_RST_SW = 3, ESP_RST_PANIC = 4, ESP_RST_INT_WDT = 5;
constexpr int ESP_RST_TASK_WDT = 6, ESP_RST_WDT = 7, ESP_RST_BROWNOUT = 9;
esp_reset_reason_t esp_reset_reason();
[[noreturn]] void esp_restart();
esp_err_t esp_register_shutdown_handler(void (*handler)());
esp_err_t esp_brownout_register_callback(void (*handler)());
int64_t esp_timer_get_time();
esp_err_t esp_task_wdt_add(TaskHandle_t task);
esp_err_t esp_task_wdt_reset();
uint32_t esp_cpu_get_cycle_count();
uint32_t esp_random();
struct panic_info_t {};

// GPIO
using gpio_num_t = int;
constexpr gpio_num_t GPIO_NUM_NC = -1, GPIO_NUM_MAX = fake::kPins;
enum { GPIO_MODE_INPUT = 1, GPIO_MODE_OUTPUT = 2 };
enum { GPIO_PULLUP_DISABLE, GPIO_PULLUP_ENABLE };
enum { GPIO_PULLDOWN_DISABLE, GPIO_PULLDOWN_ENABLE };
enum { GPIO_INTR_DISABLE, GPIO_INTR_NEGEDGE = 2 };
struct gpio_config_t {
  uint64_t pin_bit_mask;
  int mode, pull_up_en, pull_down_en, intr_type;
};
esp_err_t gpio_config(const gpio_config_t* setting);
esp_err_t gpio_set_level(gpio_num_t pin, uint32_t level);
esp_err_t gpio_set_direction(gpio_num_t pin, int mode);
int gpio_get_level(gpio_num_t pin);
esp_err_t gpio_install_isr_service(int flags);
esp_err_t gpio_isr_handler_add(gpio_num_t pin, void (*handler)(void*), void* argument);
constexpr uint32_t GPIO_OUT_W1TS_REG = 0x3FF44008;
constexpr uint32_t GPIO_OUT_W1TC_REG = 0x3FF4400C, GPIO_OUT1_W1TC_REG = 0x3FF44018;
constexpr uint32_t GPIO_ENABLE_W1TS_REG = 0x3FF44024, GPIO_ENABLE1_W1TS_REG = 0x3FF44030;
constexpr uint32_t GPIO_FUNC0_OUT_SEL_CFG_REG = 0x3FF44530, SIG_GPIO_OUT_IDX = 256;
void REG_WRITE(uint32_t address, uint32_t value);

// LEDC
using ledc_mode_t = int;
using ledc_timer_t = int;
using ledc_channel_t = int;
using ledc_timer_bit_t = int;
#if FAKE_ESP32S3
constexpr ledc_mode_t LEDC_LOW_SPEED_MODE = 0;
#else
constexpr ledc_mode_t LEDC_HIGH_SPEED_MODE = 0, LEDC_LOW_SPEED_MODE = 1;
constexpr uint32_t LEDC_DUTY_START_HSCH0 = fake::Channel::kStart;
constexpr uint32_t LEDC_HSTIMER0_RST = fake::Counter::kReset;
#endif
constexpr ledc_timer_t LEDC_TIMER_0 = 0;
enum { LEDC_USE_APB_CLK = 1 };
struct ledc_timer_config_t {
  ledc_mode_t speed_mode;
  ledc_timer_bit_t duty_resolution;
  ledc_timer_t timer_num;
  uint32_t freq_hz;
  int clk_cfg;
};
struct ledc_channel_config_t {
  int gpio_num;
  ledc_mode_t speed_mode;
  ledc_channel_t channel;
  ledc_timer_t timer_sel;
  uint32_t duty;
  int hpoint;
};
esp_err_t ledc_timer_config(const ledc_timer_config_t* setting);
esp_err_t ledc_channel_config(const ledc_channel_config_t* setting);

constexpr uint32_t LEDC_DUTY_START_LSCH0 = fake::Channel::kStart;
constexpr uint32_t LEDC_PARA_UP_LSCH0 = fake::Channel::kUpdate;
constexpr uint32_t LEDC_LSTIMER0_RST = fake::Counter::kReset;
struct ledc_dev_t {
  struct {
    std::array<fake::Channel, 8> channel;
  } channel_group[fake::kGroups];
  struct {
    std::array<fake::Counter, 4> timer;
  } timer_group[fake::kGroups];
  ledc_dev_t() {
    for (auto& one : channel_group[LEDC_LOW_SPEED_MODE].channel) {
      one.group = LEDC_LOW_SPEED_MODE;
      one.is_slow = true;
    }
    for (auto& one : timer_group[LEDC_LOW_SPEED_MODE].timer) one.group = LEDC_LOW_SPEED_MODE;
  }
};
extern ledc_dev_t LEDC;

// GPTimer
struct gptimer_t;
using gptimer_handle_t = gptimer_t*;
enum { GPTIMER_CLK_SRC_APB = 4, GPTIMER_COUNT_UP = 1 };
struct gptimer_config_t {
  int clk_src, direction;
  uint32_t resolution_hz;
};
struct gptimer_alarm_config_t {
  uint64_t alarm_count, reload_count;
  struct {
    uint32_t auto_reload_on_alarm;
  } flags;
};
esp_err_t gptimer_new_timer(const gptimer_config_t* setting, gptimer_handle_t* timer);
esp_err_t gptimer_set_alarm_action(gptimer_handle_t timer, const gptimer_alarm_config_t* alarm);
esp_err_t gptimer_enable(gptimer_handle_t timer);
esp_err_t gptimer_start(gptimer_handle_t timer);
esp_err_t gptimer_get_raw_count(gptimer_handle_t timer, uint64_t* count);
esp_err_t gptimer_set_raw_count(gptimer_handle_t timer, uint64_t count);

// Its registers: an alarm takes itself back, and its interrupt comes again until it is cleared.
struct timg_dev_t {
  bool is_armed, is_raised, is_heard;
  uint64_t captured;
};
extern timg_dev_t TIMERG0;
#define TIMER_LL_GET_HW(group) (&TIMERG0)
#define TIMER_LL_EVENT_ALARM(timer) (1U << (timer))
inline void timer_ll_enable_alarm(timg_dev_t* own, uint32_t, bool on) { own->is_armed = on; }
inline void timer_ll_enable_intr(timg_dev_t* own, uint32_t, bool on) { own->is_heard = on; }
inline void timer_ll_clear_intr_status(timg_dev_t* own, uint32_t) { own->is_raised = false; }
void timer_ll_trigger_soft_capture(timg_dev_t* own, uint32_t timer);
inline uint64_t timer_ll_get_counter_value(timg_dev_t* own, uint32_t) { return own->captured; }
struct timer_group_signal_conn_t {
  struct {
    int timer_irq_id[2];
  } groups[2];
};
constexpr timer_group_signal_conn_t timer_group_periph_signals{{{{14, 15}}, {{18, 19}}}};

// Interrupts
enum { ESP_INTR_FLAG_LEVEL3 = 1 << 3, ESP_INTR_FLAG_IRAM = 1 << 10 };
using intr_handler_t = void (*)(void*);
struct intr_handle_data_t;
esp_err_t esp_intr_alloc(int source, int flags, intr_handler_t handler, void* argument,
                         intr_handle_data_t** handle);

// UART
using uart_port_t = int;
constexpr uart_port_t UART_NUM_0 = 0;
enum {
  UART_DATA_8_BITS = 3,
  UART_PARITY_DISABLE = 0,
  UART_STOP_BITS_1 = 1,
  UART_HW_FLOWCTRL_DISABLE = 0,
  UART_SCLK_DEFAULT = 4
};
struct uart_config_t {
  int baud_rate, data_bits, parity, stop_bits, flow_ctrl, source_clk;
};
esp_err_t uart_driver_install(uart_port_t port, int receive, int send, int queue, void*, int flags);
esp_err_t uart_param_config(uart_port_t port, const uart_config_t* setting);
esp_err_t uart_wait_tx_done(uart_port_t port, TickType_t ticks);
esp_err_t uart_set_baudrate(uart_port_t port, uint32_t baud);
int uart_read_bytes(uart_port_t port, void* bytes, uint32_t count, TickType_t ticks);
int uart_write_bytes(uart_port_t port, const void* bytes, size_t count);

// USB Serial/JTAG
struct usb_serial_jtag_driver_config_t {
  uint32_t tx_buffer_size, rx_buffer_size;
};
esp_err_t usb_serial_jtag_driver_install(usb_serial_jtag_driver_config_t* setting);
int usb_serial_jtag_read_bytes(void* bytes, uint32_t count, TickType_t ticks);
int usb_serial_jtag_write_bytes(const void* bytes, size_t count, TickType_t ticks);

// I2C
using i2c_master_bus_handle_t = void*;
using i2c_master_dev_handle_t = void*;
enum { I2C_NUM_0 = 0, I2C_CLK_SRC_DEFAULT = 4, I2C_ADDR_BIT_LEN_7 = 0 };
struct i2c_master_bus_config_t {
  int i2c_port;
  gpio_num_t sda_io_num, scl_io_num;
  int clk_source, glitch_ignore_cnt;
  struct {
    uint32_t enable_internal_pullup;
  } flags;
};
struct i2c_device_config_t {
  int dev_addr_length, device_address;
  uint32_t scl_speed_hz;
};
esp_err_t i2c_new_master_bus(const i2c_master_bus_config_t* setting, i2c_master_bus_handle_t* bus);
esp_err_t i2c_master_bus_add_device(i2c_master_bus_handle_t bus, const i2c_device_config_t* setting,
                                    i2c_master_dev_handle_t* device);
esp_err_t i2c_master_transmit(i2c_master_dev_handle_t, const uint8_t*, size_t, int);
esp_err_t i2c_master_transmit_receive(i2c_master_dev_handle_t, const uint8_t*, size_t, uint8_t*,
                                      size_t, int);
esp_err_t i2c_master_bus_reset(i2c_master_bus_handle_t bus);

// Converter
#include "converter.hpp"

// Partitions
using esp_partition_type_t = int;
using esp_partition_subtype_t = int;
struct esp_partition_t {
  std::string label;
  uint32_t size;
};
using esp_partition_mmap_handle_t = uint32_t;
enum { ESP_PARTITION_MMAP_DATA = 0 };
const esp_partition_t* esp_partition_find_first(esp_partition_type_t type,
                                                esp_partition_subtype_t subtype, const char* label);
esp_err_t esp_partition_mmap(const esp_partition_t* partition, size_t offset, size_t size,
                             int memory, const void** mapped, esp_partition_mmap_handle_t* handle);
esp_err_t esp_partition_read(const esp_partition_t* partition, size_t offset, void* bytes,
                             size_t count);
esp_err_t esp_partition_write(const esp_partition_t* partition, size_t offset, const void* bytes,
                              size_t count);
esp_err_t esp_partition_erase_range(const esp_partition_t* partition, size_t offset, size_t size);

// Network
using esp_event_base_t = const char*;
extern const char* const IP_EVENT;
extern const char* const WIFI_EVENT;
enum { IP_EVENT_STA_GOT_IP = 0 };
enum { WIFI_EVENT_STA_START = 2, WIFI_EVENT_STA_DISCONNECTED = 5, ESP_EVENT_ANY_ID = -1 };
struct ip_event_got_ip_t {
  struct {
    struct {
      uint32_t addr;
    } ip;
  } ip_info;
};
struct wifi_init_config_t {
  int nvs_enable;
};
#define WIFI_INIT_CONFIG_DEFAULT() {1}
enum { WIFI_STORAGE_RAM = 1, WIFI_MODE_STA = 1, WIFI_AUTH_OPEN = 0, WIFI_AUTH_WPA2_PSK = 3 };
enum { WIFI_IF_STA = 0, WIFI_PS_NONE = 0 };
struct wifi_config_t {
  struct {
    uint8_t ssid[32], password[64];
    struct {
      int authmode;
    } threshold;
  } sta;
};
struct esp_netif_t;
esp_err_t esp_netif_init();
esp_err_t esp_event_loop_create_default();
esp_netif_t* esp_netif_create_default_wifi_sta();
using esp_event_handler_t = void (*)(void*, esp_event_base_t, int32_t, void*);
esp_err_t esp_event_handler_instance_register(esp_event_base_t base, int32_t event,
                                              esp_event_handler_t handler, void* argument,
                                              void* instance);
esp_err_t esp_wifi_init(const wifi_init_config_t* setting);
esp_err_t esp_wifi_set_storage(int storage);
esp_err_t esp_wifi_set_mode(int mode);
esp_err_t esp_wifi_set_config(int interface, const wifi_config_t* setting);
esp_err_t esp_wifi_start();
esp_err_t esp_wifi_set_ps(int mode);
esp_err_t esp_wifi_connect();

// lwip: the names of the host's own sockets, led elsewhere.
#include <netinet/in.h>
#include <sys/socket.h>
int fake_socket(int family, int type, int protocol);
int fake_bind(int socket, const sockaddr* own, socklen_t size);
int fake_recvfrom(int socket, void* bytes, size_t count, int flags, sockaddr* peer,
                  socklen_t* size);
int fake_sendto(int socket, const void* bytes, size_t count, int flags, const sockaddr* peer,
                socklen_t size);
#define socket fake_socket
#define bind fake_bind
#define recvfrom fake_recvfrom
#define sendto fake_sendto

// mbedtls
struct mbedtls_md_context_t {};
struct mbedtls_md_info_t {};
enum { MBEDTLS_MD_SHA256 = 9 };
void mbedtls_md_init(mbedtls_md_context_t* context);
const mbedtls_md_info_t* mbedtls_md_info_from_type(int type);
int mbedtls_md_setup(mbedtls_md_context_t* context, const mbedtls_md_info_t* info, int hmac);
int mbedtls_md_hmac_starts(mbedtls_md_context_t* context, const uint8_t* key, size_t size);
int mbedtls_md_hmac_update(mbedtls_md_context_t* context, const uint8_t* bytes, size_t count);
int mbedtls_md_hmac_finish(mbedtls_md_context_t* context, uint8_t* mac);

// sdkconfig.h
#if FAKE_ESP32S3
#define CONFIG_IDF_TARGET_ESP32S3 1
#else
#define CONFIG_IDF_TARGET_ESP32 1
#endif
#define CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ 240
