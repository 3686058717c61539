#include "emulator/panels.hpp"

#include <algorithm>
#include <cmath>

namespace chladni::emulator {

namespace {

constexpr uint8_t kFtAddress = 0x38;
constexpr uint32_t kFtPoints = 2;
constexpr uint32_t kFtMonitor = 0x86, kFtChip = 0xA3;
constexpr uint32_t kGtBase = 0x8000, kGtProduct = 0x140, kGtState = 0x14E;
constexpr uint32_t kFtMonitorUs = 40000;

}  // namespace

void Panel::mount(PanelModel model, const Config& config, bool is_second_address) {
  model_ = model;
  mounting_ = config;
  address_ = model == PanelModel::kFt6x36 ? kFtAddress : (is_second_address ? 0x14 : 0x5D);
  power_on();
}

void Panel::power_on() {
  registers_.fill(0);
  pointer_ = shown_ = 0;
  faults_.pulses_until_free = 0;
  if (model_ == PanelModel::kFt6x36) {
    registers_[kFtChip] = 0x64;
    registers_[kFtMonitor] = 1;
  } else if (model_ == PanelModel::kGt911) {
    registers_[kGtProduct] = '9';
    registers_[kGtProduct + 1] = registers_[kGtProduct + 2] = '1';
  }
}

void Panel::to_panel(double x_mm, double y_mm, double& u_mm, double& v_mm) const {
  const double x = x_mm - mounting_.panel_x_um / 1e3, y = y_mm - mounting_.panel_y_um / 1e3;
  // Back by the turns, then out of the mirror.
  const double angle = -std::acos(-1.0) / 2.0 * mounting_.panel_turns;
  u_mm = std::cos(angle) * x - std::sin(angle) * y;
  v_mm = std::sin(angle) * x + std::cos(angle) * y;
  if (mounting_.panel_mirrored != 0) u_mm = -u_mm;
}

bool Panel::sees(double x_mm, double y_mm) const {
  double u = 0.0, v = 0.0;
  to_panel(x_mm, y_mm, u, v);
  constexpr double kSlack = 1e-6;
  return std::fabs(u) <= mounting_.panel_width_um / 2e3 + kSlack &&
         std::fabs(v) <= mounting_.panel_length_um / 2e3 + kSlack;
}

Panel::Pixel Panel::pixel(double x_mm, double y_mm) const {
  double u = 0.0, v = 0.0;
  to_panel(x_mm, y_mm, u, v);
  const auto along = [](double place_mm, double size_um, double count) {
    const double cell = std::floor((place_mm * 1e3 / size_um + 0.5) * count);
    return static_cast<uint16_t>(cell < 0.0 ? 0.0 : (cell > count - 1.0 ? count - 1.0 : cell));
  };
  Pixel pixel{along(u, mounting_.panel_width_um, mounting_.panel_columns),
              along(v, mounting_.panel_length_um, mounting_.panel_rows)};
  if (faults_.is_off_range) pixel.x = 4095;
  return pixel;
}

bool Panel::scan(const std::vector<PanelFinger>& fingers) {
  if (model_ == PanelModel::kNone || faults_.is_absent || faults_.is_silent) return false;
  std::vector<PanelFinger> seen;
  for (const PanelFinger& finger : fingers) {
    if (sees(finger.x_mm, finger.y_mm)) seen.push_back(finger);
  }
  const bool has_lifted = shown_ > 0 && seen.empty();
  if (has_lifted && faults_.loses_next_lift) {
    // What was last seen stays in the registers, and the firmware is not called.
    faults_.loses_next_lift = false;
    shown_ = 0;
    return false;
  }
  if (seen.empty() && !has_lifted) return false;
  if (model_ == PanelModel::kGt911) {
    if ((registers_[kGtState] & 0x80) != 0) return false;  // not read yet
    show_gt911(seen);
  } else {
    show_ft6x36(seen);
  }
  shown_ = static_cast<uint32_t>(seen.size());
  return !faults_.loses_calls;
}

void Panel::show_ft6x36(const std::vector<PanelFinger>& fingers) {
  const size_t count = fingers.size() < kFtPoints ? fingers.size() : kFtPoints;
  registers_[0x02] = static_cast<uint8_t>(count);
  for (size_t k = 0; k < count; ++k) {
    const Pixel at = pixel(fingers[k].x_mm, fingers[k].y_mm);
    uint8_t* const point = &registers_[0x03 + 6 * k];
    const unsigned event = shown_ > k ? 2U : 0U;
    point[0] = static_cast<uint8_t>((event << 6) | (at.x >> 8));
    point[1] = static_cast<uint8_t>(at.x & 0xFF);
    point[2] = static_cast<uint8_t>((fingers[k].id << 4) | (at.y >> 8));
    point[3] = static_cast<uint8_t>(at.y & 0xFF);
  }
}

void Panel::show_gt911(std::vector<PanelFinger> fingers) {
  // By their numbers, however long they have been there.
  std::sort(fingers.begin(), fingers.end(),
            [](const PanelFinger& one, const PanelFinger& other) { return one.id < other.id; });
  const size_t count = fingers.size() < faults_.most_listed ? fingers.size() : faults_.most_listed;
  registers_[kGtState] = static_cast<uint8_t>(0x80 | (faults_.is_palm ? 0x40 : 0) | count);
  for (size_t k = 0; k < count; ++k) {
    const Pixel at = pixel(fingers[k].x_mm, fingers[k].y_mm);
    uint8_t* const point = &registers_[kGtState + 1 + 8 * k];
    point[0] = fingers[k].id;
    point[1] = static_cast<uint8_t>(at.x & 0xFF);
    point[2] = static_cast<uint8_t>(at.x >> 8);
    point[3] = static_cast<uint8_t>(at.y & 0xFF);
    point[4] = static_cast<uint8_t>(at.y >> 8);
    point[5] = 40;
  }
}

BusStatus Panel::transfer(uint8_t address, const uint8_t* written, uint32_t write_count,
                          uint8_t* read, uint32_t read_count) {
  if (faults_.pulses_until_free > 0) return BusStatus::kStuck;
  const bool is_here = model_ != PanelModel::kNone && !faults_.is_absent && !faults_.is_wedged;
  if (!is_here || address != address_) return BusStatus::kNoAnswer;
  const uint32_t width = model_ == PanelModel::kGt911 ? 2 : 1;
  if (write_count >= width) {
    pointer_ =
        width == 1 ? written[0] : (static_cast<uint32_t>(written[0]) << 8 | written[1]) - kGtBase;
    for (uint32_t k = width; k < write_count; ++k) registers_[pointer_++ % kRegisters] = written[k];
  }
  for (uint32_t k = 0; k < read_count; ++k) read[k] = registers_[pointer_++ % kRegisters];
  return BusStatus::kOk;
}

// Nine pulses, as a master gives.
void Panel::clock_free() {
  uint32_t& left = faults_.pulses_until_free;
  left = left > 9 ? left - 9 : 0;
}

uint32_t Panel::period_us(bool is_touched) const {
  const bool is_slow = model_ == PanelModel::kFt6x36 && registers_[kFtMonitor] != 0 && !is_touched;
  return is_slow ? kFtMonitorUs : mounting_.report_ms * 1000U;
}

}  // namespace chladni::emulator
