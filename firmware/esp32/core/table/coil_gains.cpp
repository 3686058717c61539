#include "core/table/coil_gains.hpp"

namespace chladni {

void apply_coil_gains(const Config& config, Drive& drive) {
  constexpr int32_t kOne = 32767;
  for (uint32_t k = 0; k < config.channels; ++k) {
    const int32_t gain = config.coil_gain_q15[k];
    if (gain != kOne) drive[k] = scaled(drive[k], gain);
  }
}

}  // namespace chladni
