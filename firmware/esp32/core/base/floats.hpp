// Floats in bytes, for the main loop: what makes samples reckons in integers.
#pragma once

#include "core/base/bytes.hpp"

namespace chladni {

// IEEE 754 of 32 bits, which every chip here has.
inline float read_f32(const uint8_t* bytes) { return __builtin_bit_cast(float, read_u32(bytes)); }

}  // namespace chladni
