// Runs chip/ on the fake, a line from standard input at a time:
//
//   run N        N turns of the main loop; answers "HEX PINS MICROSECONDS": what was sent over the
//                wire, gates that were on at any turn, the clock
//   rx HEX       bytes to the device
//   udp HEX      a datagram to it
//   die 0|1      whether the sample interrupt is dead
//   twice        the next sample interrupt fires twice
//   shift STEPS  the carrier stands elsewhere, as after a timer that was started again
//   late CYCLES  the next sample interrupt comes so long after its alarm
//   panic, brownout, restart   the ways down; answers with gates that are on after it
//   position     where in the carrier period duties were written last
//   calls        how often each call was made
#include <cstdio>
#include <iostream>
#include <set>
#include <sstream>

#include "idf.hpp"

extern "C" void app_main();
extern "C" void __wrap_esp_panic_handler(panic_info_t* info);
extern "C" void __real_esp_panic_handler(panic_info_t*) {}

namespace {

using fake::chip;

std::set<uint32_t> seen_on;

std::vector<uint8_t> bytes_of(const std::string& hex) {
  std::vector<uint8_t> bytes;
  for (size_t k = 0; k + 1 < hex.size(); k += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoi(hex.substr(k, 2), nullptr, 16)));
  }
  return bytes;
}

std::string pins_on() {
  std::string text;
  for (uint32_t pin = 0; pin < static_cast<uint32_t>(fake::kPins); ++pin) {
    if (chip.is_on(pin)) text += std::to_string(pin) + ",";
  }
  return text.empty() ? "-" : text;
}

void report() {
  std::string hex = "=";
  char digits[3];
  for (const char byte : chip.sent) {
    std::snprintf(digits, sizeof(digits), "%02x", static_cast<uint8_t>(byte));
    hex += digits;
  }
  chip.sent.clear();
  std::string pins;
  for (const uint32_t pin : seen_on) pins += std::to_string(pin) + ",";
  seen_on.clear();
  std::cout << hex << ' ' << (pins.empty() ? "-" : pins) << ' ' << chip.cycles / 240U << std::endl;
}

// Until the next run; false at the end of the input.
bool obey() {
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string what, argument;
    words >> what >> argument;
    if (what == "run") {
      chip.last_turn = chip.turns + std::stoi(argument);
      return true;
    }
    if (what == "rx") {
      for (const uint8_t byte : bytes_of(argument)) chip.received.push_back(byte);
    } else if (what == "udp") {
      chip.datagrams_in.push_back(bytes_of(argument));
    } else if (what == "twice") {
      chip.must_repeat = true;
    } else if (what == "shift") {
      // Of the carrier beside the alarm; both groups have one clock.
      for (uint64_t& start : chip.started) start += 3U * std::stoul(argument);
    } else if (what == "late") {
      chip.latency = std::stoul(argument);
    } else if (what == "die") {
      chip.is_interrupt_dead = argument == "1";
    } else if (what == "panic") {
      panic_info_t info;
      __wrap_esp_panic_handler(&info);
      std::cout << pins_on() << std::endl;
    } else if (what == "brownout") {
      if (chip.brown_out != nullptr) chip.brown_out();
      std::cout << pins_on() << std::endl;
    } else if (what == "position") {
      // Of the next interrupt's writes: what the timer and the carrier make of it now.
      chip.has_straddled = false;
      chip.advance(48000);
      std::cout << chip.last_write << ' ' << (chip.has_straddled ? "straddled" : "-") << std::endl;
    } else if (what == "lag") {
      // Of the second group, in steps; the registers' own truth, which no read disturbs.
      const auto cycles = static_cast<int64_t>(chip.started[1] - chip.started[0]);
      std::cout << static_cast<double>(cycles) / 3.0 - chip.apart << std::endl;
    } else if (what == "calls") {
      for (const auto& [name, count] : chip.calls) std::cout << name << ' ' << count << ' ';
      std::cout << std::endl;
    }
  }
  return false;
}

void on_turn(int turn) {
  for (uint32_t pin = 0; pin < static_cast<uint32_t>(fake::kPins); ++pin) {
    if (chip.is_on(pin)) seen_on.insert(pin);
  }
  if (turn < chip.last_turn) return;
  report();
  if (!obey()) throw fake::Stopped{};
}

}  // namespace

// The linker's names for the section of RTC_NOINIT_ATTR.
extern "C" uint8_t __start_rtc_noinit[];

// Arguments: name:hex of a partition ("small" for tables that are too few), fail=CALL:K, crash=CALL
// for one that asserts, reset=WHY,
// retained=hex of what RTC memory still holds, read=cycles and write=cycles that a register takes,
// another-timer for a driver that hands out one that is not ours, mute for a panel that does not
// answer, stuck for one that holds its line.
int main(int count, char** arguments) {
  bool is_panel_mute = false;
  for (int k = 1; k < count; ++k) {
    const std::string text = arguments[k];
    const size_t mark = text.find(':');
    if (text.rfind("fail=", 0) == 0) {
      chip.failing = text.substr(5, mark - 5);
      chip.failing_at = std::stoi(text.substr(mark + 1));
      continue;
    }
    if (text.rfind("crash=", 0) == 0) {
      chip.crashing = text.substr(6);
      continue;
    }
    if (text.rfind("retained=", 0) == 0) {
      const std::vector<uint8_t> held = bytes_of(text.substr(9));
      std::copy(held.begin(), held.end(), __start_rtc_noinit);
      continue;
    }
    if (text.rfind("reset=", 0) == 0) {
      chip.reset_reason = std::stoi(text.substr(6));
      continue;
    }
    if (text.rfind("apart=", 0) == 0) {
      chip.apart = std::stoi(text.substr(6));
      continue;
    }
    if (text.rfind("read=", 0) == 0) {
      chip.read_cycles = std::stoul(text.substr(5));
      continue;
    }
    if (text.rfind("write=", 0) == 0) {
      chip.write_cycles = std::stoul(text.substr(6));
      continue;
    }
    if (text == "another-timer") {
      chip.is_timer_another = true;
      continue;
    }
    if (text == "mute" || text == "stuck") {
      is_panel_mute = true;
      chip.is_bus_stuck = text == "stuck";
      continue;
    }
    const std::string name = text.substr(0, mark);
    const bool is_small = text.substr(mark + 1) == "small";
    const size_t size = is_small            ? 0x1000
                        : name == "tables"  ? 0x80000
                        : name == "effects" ? 0x20000
                        : name == "config"  ? 0x2000
                                            : 0x1000;
    std::vector<uint8_t> content(size, 0xFF);
    const std::vector<uint8_t> first = bytes_of(is_small ? "" : text.substr(mark + 1));
    std::copy(first.begin(), first.end(), content.begin());
    chip.flash[name] = content;
  }
  chip.on_turn = on_turn;
  chip.does_panel_answer = !is_panel_mute;
  if (!obey()) return 0;
  try {
    app_main();
  } catch (const fake::Stopped&) {
    return 0;
  } catch (const fake::Restarted&) {
    std::cout << "restarted " << pins_on() << std::endl;
  } catch (const fake::Aborted&) {
    std::cout << "aborted " << pins_on() << std::endl;
  } catch (const fake::Misuse& misuse) {
    std::cout << "misuse " << misuse.what() << std::endl;
    return 3;
  }
  return 0;
}
