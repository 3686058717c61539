#include "core/touch/panel_map.hpp"

namespace chladni {

bool PanelMap::contains(const Finger& finger) const {
  return finger.x < columns_ && finger.y < rows_;
}

Place PanelMap::to_board(const Finger& finger) const {
  // Twice the pixels from the middle to the pixel's centre: at most the panel's count, so that the
  // product is at most its size in 1/128 um.
  const int32_t along_x = ((2 * finger.x + 1 - columns_) * scale_x_q8_) / 256;
  const int32_t v = ((2 * finger.y + 1 - rows_) * scale_y_q8_) / 256;
  const int32_t u = is_mirrored_ ? -along_x : along_x;
  switch (turns_) {
    case 0: return {u + offset_x_um_, v + offset_y_um_};
    case 1: return {-v + offset_x_um_, u + offset_y_um_};
    case 2: return {-u + offset_x_um_, -v + offset_y_um_};
    default: return {v + offset_x_um_, -u + offset_y_um_};
  }
}

}  // namespace chladni
