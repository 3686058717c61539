// A drive as the coils are wound and measured: polarity and trim of each.
#pragma once

#include "core/generated/config_format.hpp"
#include "core/synthesis/synthesis.hpp"

namespace chladni {

// Multiplies each channel's gain with that of its coil.
void apply_coil_gains(const Config& config, Drive& drive);

}  // namespace chladni
