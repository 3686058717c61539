#include "core/table/coil_gains.hpp"

namespace chladni {

void apply_coil_gains(const Config& config, Drive& drive) {
  constexpr int32_t kOne = 32767;
  const auto scaled = [](int16_t value, int32_t gain) {
    return static_cast<int16_t>((value * gain + (1 << 14)) >> 15);
  };
  for (uint32_t k = 0; k < config.channels; ++k) {
    const int32_t gain = config.coil_gain_q15[k];
    if (gain == kOne) continue;
    Gain& own = drive[k];
    own = {scaled(own.in_phase_q15, gain), scaled(own.quadrature_q15, gain)};
  }
}

}  // namespace chladni
