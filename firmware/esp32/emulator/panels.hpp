// Touch controllers as register models on an I2C bus, with ways to misbehave on command.
//
// The finger's place is turned into pixels here, in floating point and the other way round than the
// firmware does it: neither can hide the other's mistake.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/generated/config_format.hpp"
#include "core/hal.hpp"

namespace chladni::emulator {

enum class PanelModel : uint8_t { kNone, kFt6x36, kGt911 };

struct PanelFinger {
  uint8_t id;
  double x_mm;  // on the board
  double y_mm;
};

// What can go wrong with a panel.
struct PanelFaults {
  bool is_absent = false;     // no panel at the address
  bool is_wedged = false;     // acknowledges nothing any more
  bool is_silent = false;     // registers frozen, no calls
  bool is_palm = false;       // reports a large area (GT911)
  bool is_off_range = false;  // reports places beyond its pixels
  bool loses_next_lift = false;
  uint32_t most_listed = 5;        // of fingers, as a GT911 is set: up to 10
  bool loses_calls = false;        // its interrupt line never falls
  uint32_t pulses_until_free = 0;  // holds the data line until clocked so often
};

class Panel {
 public:
  // Mounted as the configuration says; a GT911 at its second address on demand.
  void mount(PanelModel model, const Config& config, bool is_second_address);
  void power_on();

  // One measurement; true if the interrupt line falls.
  bool scan(const std::vector<PanelFinger>& fingers);
  BusStatus transfer(uint8_t address, const uint8_t* written, uint32_t write_count, uint8_t* read,
                     uint32_t read_count);
  void clock_free();

  // Until the next measurement: the FT6x36's monitor mode is slower.
  uint32_t period_us(bool is_touched) const;
  PanelModel model() const { return model_; }
  // Whether a place lies on the active area.
  bool sees(double x_mm, double y_mm) const;
  PanelFaults& faults() { return faults_; }
  // It holds the bus.
  bool is_stuck() const { return faults_.pulses_until_free > 0; }
  uint8_t peek(uint32_t place) const { return registers_[place % kRegisters]; }

 private:
  static constexpr uint32_t kRegisters = 0x200;  // FT6x36: all; GT911: 0x8000 to 0x81FF

  struct Pixel {
    uint16_t x;
    uint16_t y;
  };

  Pixel pixel(double x_mm, double y_mm) const;
  void to_panel(double x_mm, double y_mm, double& u_mm, double& v_mm) const;
  void show_ft6x36(const std::vector<PanelFinger>& fingers);
  void show_gt911(std::vector<PanelFinger> fingers);

  PanelModel model_ = PanelModel::kNone;
  Config mounting_{};
  uint8_t address_ = 0;
  PanelFaults faults_{};
  std::array<uint8_t, kRegisters> registers_{};
  uint32_t pointer_ = 0;
  uint32_t shown_ = 0;  // fingers in the last measurement
};

}  // namespace chladni::emulator
