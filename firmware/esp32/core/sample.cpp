// The sample interrupt's way into the device; placed in IRAM on the chip (linker.lf).
#include "core/device.hpp"

namespace chladni {

void Device::sample() { synthesis_.sample(hal_); }

}  // namespace chladni
