// What the emulator's bindings share: faults and bad arguments become Python exceptions.
#pragma once

#include <nanobind/nanobind.h>

#include <stdexcept>
#include <string>

#include "emulator/emulator.hpp"

namespace chladni::emulator {

inline void raise_if(const std::string& fault) {
  if (!fault.empty()) throw std::runtime_error(fault);
}

// What the emulated board is like, how its panel fails, and its outputs by themselves.
void bind_hardware(nanobind::module_& module);

// What the device and its board are doing.
void bind_state(nanobind::class_<Emulator>& emulator);

}  // namespace chladni::emulator
