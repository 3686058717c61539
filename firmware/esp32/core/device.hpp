// The device: a touch becomes a drive, and every way a touch can end turns the outputs off.
#pragma once

#include <cstdint>

#include "core/hal.hpp"
#include "core/synthesis.hpp"
#include "core/table.hpp"

namespace chladni {

enum class DeviceState : uint8_t {
  kNoTable,  // nothing to play; `table_status` says why
  kIdle,     // waiting for a touch
  kPlaying,  // a finger is on the board
  kSpent,    // the touch outlasted a limit; outputs are off until it lifts
};

const char* to_text(DeviceState state);

struct DeviceSettings {
  uint32_t channels;
  uint32_t pwm_bits;
  uint32_t level_q15;  // loudness, 0 to 32767
};

class Device {
 public:
  // Load the table and get ready; outputs stay off.
  TableStatus start(const Hal& hal, const DeviceSettings& settings);
  // One turn of the main loop; call it every millisecond or so.
  void poll();
  // One line from the console: "touch X Y" (micrometres), "lift", "frequency F" (millihertz) or
  // "info".
  void command(const char* line);
  // One sample; call it from the sample interrupt, every fourth carrier period.
  void sample();

  DeviceState state() const { return state_; }
  TableStatus table_status() const { return table_status_; }
  FadeCause fade_cause() const { return synthesis_.fade_cause(); }
  const Table& table() const { return table_; }

 private:
  void contact(Place place);
  void lifted();
  const char* select_frequency(uint32_t frequency_mhz);

  Hal hal_{};
  DeviceSettings settings_{};
  DeviceState state_ = DeviceState::kNoTable;
  TableStatus table_status_ = TableStatus::kNone;
  Place place_{};
  bool is_drive_pending_ = false;
  bool is_start_pending_ = false;
  uint32_t last_contact_us_ = 0;
  bool is_release_pending_ = false;
  // A touch from the console lasts until "lift", so it is kept alive here.
  bool is_console_touch_ = false;
  Place console_place_{};
  Table table_;
  Synthesis synthesis_;
};

}  // namespace chladni
