// A board on a PC: the firmware core on a virtual clock, with flash, PWM and a finger.
//
// Time is counted in carrier periods. The sample interrupt comes once in every fourth one and its
// duties are latched together when the next begins; the main loop turns once a millisecond, never
// in the middle of a sample; the panel reports at its own rate.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/device.hpp"
#include "emulator/flash.hpp"
#include "emulator/pwm.hpp"

namespace chladni::emulator {

struct FingerEvent {
  uint64_t at_us;
  bool is_down;  // at the place, or lifted
  Place place;
};

struct EmulatorSettings {
  uint32_t channels;
  uint32_t pwm_bits;
  uint32_t level_q15;
  uint32_t panel_period_us;  // between two reports of a touch
  uint32_t flash_sectors;    // of the table partition
};

class Emulator {
 public:
  explicit Emulator(const EmulatorSettings& settings);
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  // Power on: RAM is lost, flash stays.
  TableStatus boot();
  // Advance the virtual clock. Stops at the first fault.
  void run_us(uint64_t microseconds);
  // Fingers by time, in ascending order and not before now.
  void add_finger(const FingerEvent& event) { fingers_.push_back(event); }
  // Stop the main loop (a hung task) while interrupts go on.
  void set_main_loop_hung(bool is_hung) { is_main_loop_hung_ = is_hung; }
  // The panel stops reporting, lift-up included.
  void set_panel_silent(bool is_silent) { is_panel_silent_ = is_silent; }
  // The next lift-up is never reported.
  void lose_next_lift() { is_next_lift_lost_ = true; }
  void command(const std::string& line) {
    if (is_booted_) {
      device_.command(line.c_str());
    } else {
      note("the board is not powered on");
    }
  }

  Flash& flash() { return flash_; }
  Pwm& pwm() { return pwm_; }
  const Device& device() const { return device_; }
  uint64_t now_us() const;
  uint64_t period() const { return period_; }
  // What the firmware did that hardware would not forgive; empty while all is well.
  const std::string& fault() const { return fault_; }
  const std::vector<std::string>& printed() const { return printed_; }

 private:
  static Emulator& from(void* context) { return *static_cast<Emulator*>(context); }
  Hal hal();
  Touch report(Place* place);
  void note(const std::string& fault) {
    if (fault_.empty()) fault_ = fault;
  }

  EmulatorSettings settings_;
  Flash flash_;
  Pwm pwm_;
  Device device_;
  uint64_t period_ = 0;
  uint64_t next_poll_us_ = 0;
  uint64_t next_report_us_ = 0;
  std::vector<FingerEvent> fingers_;
  size_t next_finger_ = 0;
  bool is_finger_down_ = false;
  Place finger_{};
  bool is_lift_unreported_ = false;
  bool is_booted_ = false;
  bool is_next_lift_lost_ = false;
  bool is_main_loop_hung_ = false;
  bool is_panel_silent_ = false;
  std::string fault_;
  std::vector<std::string> printed_;
};

}  // namespace chladni::emulator
