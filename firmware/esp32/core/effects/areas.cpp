#include "core/effects/areas.hpp"

#include "core/fingers/real.hpp"

namespace chladni {

namespace {

namespace f = bank_format;

struct Vector {
  float x;
  float y;
};

Vector from_to(Place from, Place to) {
  return {static_cast<float>(to.x_um - from.x_um), static_cast<float>(to.y_um - from.y_um)};
}

float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y; }

bool is_in_polygon(const BankArea& area, Place place) {
  bool is_in = false;
  Place before = area.point(area.corners - 1U);
  for (uint32_t k = 0; k < area.corners; ++k) {
    const Place corner = area.point(k);
    // A line from the place to the right crosses this side.
    if ((corner.y_um > place.y_um) != (before.y_um > place.y_um)) {
      const Vector side = from_to(corner, before), own = from_to(corner, place);
      const float left = own.x * side.y - side.x * own.y;
      if (side.y > 0.0F ? left < 0.0F : left > 0.0F) is_in = !is_in;
    }
    before = corner;
  }
  return is_in;
}

// Squared, to a side.
float distance2(Place place, Place from, Place to) {
  const Vector side = from_to(from, to), own = from_to(from, place);
  const float length2 = dot(side, side);
  float share = length2 > 0.0F ? dot(side, own) / length2 : 0.0F;
  share = share < 0.0F ? 0.0F : share > 1.0F ? 1.0F : share;
  const Vector off = {own.x - share * side.x, own.y - share * side.y};
  return dot(off, off);
}

// Whether a place is in an area, or no further outside than that.
bool has(const BankArea& area, Place place, float margin_um) {
  switch (area.shape) {
    case f::kShapeCircle: {
      const Vector off = from_to(area.point(0), place);
      const float most = static_cast<float>(area.point(1).x_um) + margin_um;
      return dot(off, off) <= most * most;
    }
    case f::kShapePolygon: {
      if (is_in_polygon(area, place)) return true;
      Place before = area.point(area.corners - 1U);
      for (uint32_t k = 0; k < area.corners; ++k) {
        if (distance2(place, before, area.point(k)) <= margin_um * margin_um) return true;
        before = area.point(k);
      }
      return false;
    }
    default: return true;
  }
}

}  // namespace

uint32_t area_at(const Bank& bank, Place place, uint32_t before) {
  const auto margin_um = static_cast<float>(bank.hysteresis_um());
  for (uint32_t k = 0; k < bank.areas(); ++k) {
    if (has(bank.area(k), place, k == before ? margin_um : 0.0F)) return k;
  }
  return kNoArea;
}

Box box_of(const BankArea& area) {
  if (area.shape == f::kShapeEverywhere) return {};
  const Place first = area.point(0);
  if (area.shape == f::kShapeCircle) {
    const int32_t radius = area.point(1).x_um;
    return {{first.x_um - radius, first.y_um - radius}, {first.x_um + radius, first.y_um + radius}};
  }
  Box box{first, first};
  for (uint32_t k = 1; k < area.corners; ++k) {
    const Place corner = area.point(k);
    if (corner.x_um < box.least.x_um) box.least.x_um = corner.x_um;
    if (corner.y_um < box.least.y_um) box.least.y_um = corner.y_um;
    if (corner.x_um > box.most.x_um) box.most.x_um = corner.x_um;
    if (corner.y_um > box.most.y_um) box.most.y_um = corner.y_um;
  }
  return box;
}

float distance_um(Place one, Place other) {
  const Vector off = from_to(one, other);
  return fingers::root(dot(off, off));
}

}  // namespace chladni
