#include "core/table/mirrors.hpp"

namespace chladni {

namespace {

// Nibble k of the eight bytes is the actuator that stands in for k. False unless that is an order
// which undoes itself.
bool read_order(const uint8_t* bytes, uint32_t actuators, Order& order) {
  for (uint32_t k = 0; k < table_format::kMaxActuators; ++k) {
    order[k] = static_cast<uint8_t>((bytes[k / 2] >> (4 * (k % 2))) & 15U);
    if (k < actuators ? order[k] >= actuators : order[k] != 0) return false;
  }
  for (uint32_t k = 0; k < actuators; ++k) {
    if (order[order[k]] != k) return false;
  }
  return true;
}

bool is_empty(const uint8_t* bytes) {
  for (uint32_t k = 0; k < table_format::kMaxActuators / 2; ++k) {
    if (bytes[k] != 0) return false;
  }
  return true;
}

}  // namespace

bool read_orders(const uint8_t* mirror_x, const uint8_t* mirror_y, uint32_t mirrors,
                 uint32_t actuators, Orders& orders) {
  orders = {};
  for (uint32_t k = 0; k < table_format::kMaxActuators; ++k) {
    orders[0][k] = static_cast<uint8_t>(k);
  }
  orders[1] = orders[2] = orders[0];
  const auto take = [&](const uint8_t* bytes, uint32_t flip) {
    return (mirrors & flip) != 0 ? read_order(bytes, actuators, orders[flip]) : is_empty(bytes);
  };
  if (!take(mirror_x, 1) || !take(mirror_y, 2)) return false;
  for (uint32_t k = 0; k < actuators; ++k) orders[3][k] = orders[1][orders[2][k]];
  return true;
}

// The order of a corner's image, after that of the place's: a gain's place behind the label.
void find_sources(const Orders& orders, uint32_t actuators, uint32_t gain_bytes,
                  SourcesByFlips& sources) {
  sources = {};
  for (uint32_t images = 0; images < 4; ++images) {
    for (uint32_t flips = 0; flips < 4; ++flips) {
      for (uint32_t k = 0; k < actuators; ++k) {
        for (uint32_t corner = 0; corner < 4; ++corner) {
          const uint32_t stored = orders[images & corner][orders[flips][k]];
          sources[images][flips][k][corner] = static_cast<uint8_t>(1 + stored * gain_bytes);
        }
      }
    }
  }
}

}  // namespace chladni
