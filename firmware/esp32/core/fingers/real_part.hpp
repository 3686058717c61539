// The real gains of a drive: a signal that is no tone has no phase to play them in.
//
// Below a plate's first resonance all of a drive is nearly in one phase, or in its opposite. That
// phase, θ with 2θ = arg Σ d², leaves the largest real part; of θ and θ + 180° it is the nearer to
// 0 that is taken out, so that what pushes a finger up still does.
#pragma once

#include <cstdint>

#include "core/fingers/complex.hpp"
#include "core/fingers/real.hpp"
#include "core/synthesis/drive.hpp"

namespace chladni {

namespace fingers {

template <typename Real>
void keep_real_part(Complex<Real>* gains, uint32_t channels) {
  Complex<Real> sum{};
  for (uint32_t k = 0; k < channels; ++k) add_product(sum, gains[k], gains[k]);
  const Real size = root(squared(sum));
  Complex<Real> phase{Real(1.0F), Real{}};
  if (size > Real{}) {
    const Real cosine = root((Real(1.0F) + sum.re / size) * Real(0.5F));
    // Close to 90° the sine is what is known.
    const Real sine = root((Real(1.0F) - sum.re / size) * Real(0.5F));
    phase = {cosine, sum.im < Real{} ? Real{} - sine : sine};
  }
  for (uint32_t k = 0; k < channels; ++k) {
    gains[k] = {gains[k].re * phase.re + gains[k].im * phase.im, Real{}};
  }
}

}  // namespace fingers

// Of a drive from the table.
void keep_real_part(Drive& drive);

}  // namespace chladni
