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

namespace fake {

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
  std::map<std::string, int> calls;
  uint64_t cycles = 1000;
  uint32_t pwm_steps = 0;  // of a carrier period; 0 while no timer runs
  std::array<Pin, 40> pins{};
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
  uint32_t last_write = 0;  // position in the carrier period
  bool has_watchdog = false;
  bool is_interrupt_dead = false, must_repeat = false;
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

// Set until the carrier's next period begins; then the duty is taken over. That of a low-speed
// channel waits for `update` before.
class DutyStart {
 public:
  operator uint32_t() const {
    return is_set_ && (!is_updated_ || chip.period(group_) <= since_) ? 1U : 0U;
  }
  void set(int group) {
    group_ = group;
    is_set_ = true;
    is_updated_ = group == 0;
    since_ = chip.period(group);
  }
  void update() { is_updated_ = true; }

 private:
  bool is_set_ = false, is_updated_ = false;
  int group_ = 0;
  uint64_t since_ = 0;
};

struct Channel {
  struct {
    DutyStart duty_start;
  } conf1;
  uint32_t waiting = 0, duty = 0;
  uint64_t written = UINT64_MAX;  // carrier period
  void settle() {
    if (conf1.duty_start == 0) duty = waiting;
  }
};
// A write to a register takes four cycles, a read eight.
struct Counter {
  int group = 0;
  struct Reset {
    int* group;
    Reset& operator=(uint32_t value) {
      chip.cycles += 4;
      if (value == 0) chip.started[static_cast<size_t>(*group)] = chip.cycles;
      return *this;
    }
  };
  struct Position {
    int* group;
    operator uint32_t() const {
      chip.cycles += 8;
      const auto apart = static_cast<uint32_t>(*group == 0 ? 0 : chip.apart);
      return chip.position(*group) + apart;
    }
  };
  struct {
    Reset rst;
  } conf{{&group}};
  struct {
    Position timer_cnt;
  } value{{&group}};
};

}  // namespace fake
