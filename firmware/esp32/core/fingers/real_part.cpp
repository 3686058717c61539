#include "core/fingers/real_part.hpp"

#include <array>

namespace chladni {

void keep_real_part(Drive& drive) {
  std::array<fingers::Complex<float>, kMaxChannels> gains{};
  for (uint32_t k = 0; k < kMaxChannels; ++k) {
    gains[k] = {static_cast<float>(drive[k].in_phase_q15),
                static_cast<float>(drive[k].quadrature_q15)};
  }
  fingers::keep_real_part(gains.data(), kMaxChannels);
  for (uint32_t k = 0; k < kMaxChannels; ++k) {
    // A gain of both parts may be √2 of full scale.
    const float real = gains[k].re, most = 32767.0F;
    const float within = real > most ? most : (real < -most ? -most : real);
    drive[k] = {static_cast<int16_t>(within + (within < 0.0F ? -0.5F : 0.5F)), 0};
  }
}

}  // namespace chladni
