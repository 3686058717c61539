// Which area of a bank a finger is in: plane geometry in single precision, a micrometre off at
// most.
#pragma once

#include <cstdint>

#include "core/effects/bank.hpp"

namespace chladni {

constexpr uint32_t kNoArea = 255;

// The first area that has a place. A finger that was in `before` has left that once it is further
// outside than the bank's hysteresis.
uint32_t area_at(const Bank& bank, Place place, uint32_t before);

// About a shape; of `everywhere` all are 0.
struct Box {
  Place least;
  Place most;
};
Box box_of(const BankArea& area);

float distance_um(Place one, Place other);

}  // namespace chladni
