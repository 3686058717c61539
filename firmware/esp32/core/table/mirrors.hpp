// A board's mirror symmetry, as its table has it: which actuator stands in for which on the other
// side, and what becomes of a drive's label and sign there. Bit 0 of all flips is x, bit 1 is y.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/table_format.hpp"

namespace chladni {

// The actuator that stands in for each, by the flips of a cell.
using Order = std::array<uint8_t, table_format::kMaxActuators>;
using Orders = std::array<Order, 4>;

// The orders of a header's two times eight bytes; false unless each undoes itself, and is all zero
// where the board has no such mirror.
bool read_orders(const uint8_t* mirror_x, const uint8_t* mirror_y, uint32_t mirrors,
                 uint32_t actuators, Orders& orders);

// Where in its record each of the four corners around a place has the gain of a channel: by the
// corners that are images and the flips of the place. Zeros end the channels.
using Sources = std::array<std::array<uint8_t, 4>, table_format::kMaxActuators + 1>;
using SourcesByFlips = std::array<std::array<Sources, 4>, 4>;
void find_sources(const Orders& orders, uint32_t actuators, uint32_t gain_bytes,
                  SourcesByFlips& sources);

// What becomes of a label across the mirrors, two bits each: it is cut there, or it goes on with
// the other sign.
constexpr uint32_t kNegatedShift = 2;
inline bool is_crossing(uint8_t code) { return code < 16 && (code & (code >> kNegatedShift)) == 0; }
inline bool is_cut(uint8_t code, uint32_t flip) { return (code & flip) != 0; }
inline uint32_t negations_of(uint8_t code) { return code >> kNegatedShift; }

}  // namespace chladni
