// What the emulator's bindings share: faults and bad arguments become Python exceptions.
#pragma once

#include <nanobind/nanobind.h>

#include <iterator>
#include <stdexcept>
#include <string>

#include "emulator/emulator.hpp"

namespace chladni::emulator {

inline void raise_if(const std::string& fault) {
  if (!fault.empty()) throw std::runtime_error(fault);
}

// By its number, as everywhere outside C++.
inline gpio::Chip chip_of(uint32_t number) {
  if (number >= std::size(gpio::kAbilities)) throw nanobind::value_error("chip: 0 or 1");
  return static_cast<gpio::Chip>(number);
}

// What the emulated board is like, how its panel fails, and its outputs by themselves.
void bind_hardware(nanobind::module_& module);

// Effect banks by themselves.
void bind_effects(nanobind::module_& module);

// The drives of several fingers by themselves, and what finding them costs.
void bind_fingers(nanobind::module_& module);
// What each finger plays.
void bind_voices(nanobind::class_<Emulator>& emulator);

// What coils read of each other.
void bind_sensing(nanobind::module_& module, nanobind::class_<Emulator>& emulator);

// The synthesis by itself.
void bind_synthesis(nanobind::module_& module);

// What the device and its board are doing.
void bind_state(nanobind::class_<Emulator>& emulator);

}  // namespace chladni::emulator
