// The sample interrupt's way into the device; placed in IRAM on the chip (linker.lf).
#include "core/device.hpp"

namespace chladni {

void Device::sample(uint32_t missed) { synthesis_.sample(hal_, missed); }

}  // namespace chladni
