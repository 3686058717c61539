// The fake's chip: its time, pins and flash, its LEDC's registers, and what a scenario asks of it.
//
// Time is a cycle counter of 240 MHz; the LEDC's steps are 3 of them and the timer's ticks 6. A
// duty waits in its register until the carrier's next period, as the Technical Reference Manual
// says of high-speed channels (ESP32 TRM, LED PWM Controller: duty_start clears at the overflow).
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

using esp_err_t = int;
constexpr esp_err_t ESP_OK = 0, ESP_FAIL = -1, ESP_ERR_NO_MEM = 0x101;
constexpr esp_err_t ESP_ERR_INVALID_ARG = 0x102, ESP_ERR_INVALID_STATE = 0x103;
constexpr esp_err_t ESP_ERR_NOT_FOUND = 0x105, ESP_ERR_TIMEOUT = 0x107;

namespace fake {

#if FAKE_ESP32S3
constexpr int kPins = 49, kGroups = 1;
constexpr uint32_t kFirstInput = 49;  // of pins that are inputs only
#else
constexpr int kPins = 40, kGroups = 2;
constexpr uint32_t kFirstInput = 34;
#endif

struct Stopped {};                    // the scenario is over
struct Restarted {};                  // esp_restart
struct Aborted {};                    // ESP_ERROR_CHECK
struct TaskEnded {};                  // vTaskDelete(nullptr)
struct Misuse : std::runtime_error {  // what the real thing would not forgive
  using std::runtime_error::runtime_error;
};

// Records a call by name; its status, ESP_FAIL where the scenario asks for it.
esp_err_t call(const char* name);

struct Pin {
  bool is_output = false;
  bool level = false;
  int channel = -1;  // of the LEDC, -1 for the GPIO's own level
};

struct Chip {
  std::string failing;
  int failing_at = 0;
  std::string crashing;  // a call that ends in an assert
  std::map<std::string, int> calls;
  uint64_t cycles = 1000;
  uint32_t pwm_steps = 0;  // of a carrier period; 0 while no timer runs
  std::array<Pin, kPins> pins{};
  std::deque<uint8_t> received;
  std::string sent;
  std::map<std::string, std::vector<uint8_t>> flash;
  int turns = 0, last_turn = 0;
  void (*on_turn)(int turn) = nullptr;
  bool does_panel_answer = false, is_bus_stuck = false;
  int reset_reason = 1;
  uint64_t latency = 480;  // cycles from the alarm into the interrupt; of the next one
  std::vector<std::vector<uint8_t>> datagrams_in, datagrams_out;
  void (*shutdown)() = nullptr;
  void (*brown_out)() = nullptr;
  uint32_t last_write = 0;                     // position in the carrier period
  uint64_t read_cycles = 8, write_cycles = 4;  // of a register
  // Of the duties of each group written in one interrupt: the first's carrier period, and whether a
  // later one came in the next.
  std::array<uint64_t, 2> first_period{UINT64_MAX, UINT64_MAX};
  bool has_straddled = false;
  void note_write(uint64_t period, int group) {
    last_write = position(group);
    uint64_t& first = first_period[static_cast<size_t>(group)];
    if (first == UINT64_MAX) first = period;
    if (period != first) has_straddled = true;
  }
  bool has_watchdog = false;
  bool is_interrupt_dead = false, must_repeat = false;
  bool is_timer_another = false;  // the driver hands out one whose registers are not looked at
  int32_t apart = 0;  // steps by which the second group stands elsewhere than a start together says

  std::array<uint64_t, 2> started{};  // cycles, of each group's timer

  uint64_t steps(int group) const { return (cycles - started[static_cast<size_t>(group)]) / 3U; }
  uint64_t period(int group) const { return pwm_steps == 0 ? 0 : steps(group) / pwm_steps; }
  uint32_t position(int group) const {
    return pwm_steps == 0 ? 0 : static_cast<uint32_t>(steps(group) % pwm_steps);
  }
  void advance(uint64_t count);
  // Whether a gate is high at any time of a carrier period.
  bool is_on(uint32_t pin) const;
};
extern Chip chip;

// A register: a write takes four cycles and a read eight, unless the scenario says otherwise.
template <typename Owner, uint32_t (Owner::*kRead)() const, void (Owner::*kWrite)(uint32_t)>
struct Register {
  Owner* owner;
  operator uint32_t() const {
    chip.cycles += chip.read_cycles;
    return (owner->*kRead)();
  }
  Register& operator=(uint32_t value) {
    chip.cycles += chip.write_cycles;
    (owner->*kWrite)(value);
    return *this;
  }
};

// The bit that starts a duty stays set until the carrier's next period begins; then the duty is
// taken over. That of a low-speed channel waits for its update bit before.
class Channel {
 public:
  int group = 0;
  bool is_slow = false;  // of a low-speed group
  // As the driver leaves them: the output's enable, and how a duty moves.
  static constexpr uint32_t kConf0 = 1U << 2, kConf1 = 1U << 30 | 1U << 20 | 1U << 10;
  static constexpr uint32_t kUpdate = 1U << 4, kStart = 1U << 31;

  uint32_t duty_now() {
    settle();
    return duty_;
  }

 private:
  bool is_pending() const { return is_started_ && (!is_updated_ || chip.period(group) <= since_); }
  void settle() {
    if (!is_pending()) duty_ = waiting_;
  }
  uint32_t read_conf0() const { return kConf0; }
  uint32_t read_conf1() const { return kConf1 | (is_pending() ? kStart : 0U); }
  uint32_t read_duty() const { return waiting_ << 4; }
  void write_conf0(uint32_t value) {
    if (!is_slow) throw Misuse("an update of a high-speed channel");
    if (value != (kConf0 | kUpdate)) throw Misuse("a channel's setting changed");
    is_updated_ = true;
  }
  void write_conf1(uint32_t value) {
    if (value != (kConf1 | kStart)) throw Misuse("how a duty moves changed");
    is_started_ = true;
    is_updated_ = !is_slow;
    since_ = chip.period(group);
  }
  void write_duty(uint32_t value) {
    const uint64_t period = chip.period(group);
    if (is_pending()) throw Misuse("a duty overwritten before it was taken");
    if (written_ == period) throw Misuse("two duties in one carrier period");
    if (value >> 4 >= chip.pwm_steps) throw Misuse("a duty beyond the timer");
    settle();
    chip.note_write(period, group);
    written_ = period;
    waiting_ = value >> 4;
  }

  bool is_started_ = false, is_updated_ = false;
  uint64_t since_ = 0, written_ = UINT64_MAX;  // carrier periods
  uint32_t waiting_ = 0, duty_ = 0;

 public:
  struct {
    Register<Channel, &Channel::read_conf0, &Channel::write_conf0> val;
  } conf0{{this}};
  struct {
    Register<Channel, &Channel::read_conf1, &Channel::write_conf1> val;
  } conf1{{this}};
  struct {
    Register<Channel, &Channel::read_duty, &Channel::write_duty> val;
  } duty{{this}};
};

// A group's timer: it counts from where its reset is taken back.
class Counter {
 public:
  int group = 0;
  static constexpr uint32_t kReset = 1U << 24;

 private:
  uint32_t read_conf() const { return conf_; }
  void write_conf(uint32_t value) {
    if ((value & kReset) == 0) chip.started[static_cast<size_t>(group)] = chip.cycles;
    conf_ = value;
  }
  uint32_t read_count() const {
    const auto apart = static_cast<uint32_t>(group == 0 ? 0 : chip.apart);
    return chip.position(group) + apart;
  }
  void write_count(uint32_t) { throw Misuse("a counter written"); }
  uint32_t conf_ = 10;

 public:
  struct {
    Register<Counter, &Counter::read_conf, &Counter::write_conf> val;
  } conf{{this}};
  struct {
    Register<Counter, &Counter::read_count, &Counter::write_count> timer_cnt;
  } value{{this}};
};

}  // namespace fake
