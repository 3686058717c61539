// Where on the board a panel's pixels lie.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/hal.hpp"
#include "core/touch/panel.hpp"

namespace chladni {

// Places of the panel's pixels' centres on the board.
class PanelMap {
 public:
  constexpr explicit PanelMap(const Config& config)
      : columns_(config.panel_columns),
        rows_(config.panel_rows),
        scale_x_q8_(scale_q8(config.panel_width_um, config.panel_columns)),
        scale_y_q8_(scale_q8(config.panel_length_um, config.panel_rows)),
        offset_x_um_(config.panel_x_um),
        offset_y_um_(config.panel_y_um),
        turns_(config.panel_turns),
        is_mirrored_(config.panel_mirrored != 0) {}
  constexpr PanelMap() : PanelMap(Config{}) {}
  bool contains(const Finger& finger) const;
  Place to_board(const Finger& finger) const;

 private:
  // Rounded: a row of pixels multiplies the error.
  static constexpr int32_t scale_q8(uint32_t size_um, uint32_t pixels) {
    return static_cast<int32_t>((size_um * 128U + pixels / 2U) / pixels);
  }

  int32_t columns_, rows_;
  int32_t scale_x_q8_, scale_y_q8_;  // micrometres per half pixel
  int32_t offset_x_um_, offset_y_um_;
  uint32_t turns_;
  bool is_mirrored_;
};

}  // namespace chladni
