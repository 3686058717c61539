#include "core/fingers/finger_drives.hpp"

#include "core/generated/link_format.hpp"

namespace chladni {

namespace {

using fingers::kMostFingers;
using fingers::kPoints;

// A finger's points from its middle, um (finger_set.hpp).
constexpr std::array<Place, kPoints> kRing = {
    {{0, 0}, {5000, 0}, {2500, 4330}, {-2500, 4330}, {-5000, 0}, {-2500, -4330}, {2500, -4330}}};
// Of what a finger feels, that another's signal may have by the plate as it is known
// (tables/chladni/drives/scoring/several_fingers/fingers_score.py has why).
constexpr float kExpectedToReal = 0.25F;
// No place off the board is further from it; sums of places stay within 32 bits.
constexpr int32_t kFarUm = 1000000;

fingers::Complex<float> number(ComplexFloat value) { return {value.re, value.im}; }

int16_t rounded_q15(float gain) {
  const float scaled = gain * 32767.0F;
  return static_cast<int16_t>(scaled < 0.0F ? scaled - 0.5F : scaled + 0.5F);
}

uint16_t whole(float value) {
  return value < 65535.0F ? static_cast<uint16_t>(value) : uint16_t{65535};
}

// 0 means that there is none.
uint16_t isolation_steps(float ratio) {
  const uint16_t steps = whole(static_cast<float>(link_format::kIsolationSteps) * ratio + 0.5F);
  return steps == 0 ? uint16_t{1} : steps;
}

// Both sides in 10 nm, at a level of 32767.
uint32_t limited(const FingerDrives::Reach& reach, uint32_t level_q15, float m_per_n) {
  const float own = m_per_n * static_cast<float>(reach.full_force_mn) * 1e5F;
  const float most = static_cast<float>(reach.most_10nm) * 32767.0F;
  return static_cast<float>(level_q15) * own > most ? static_cast<uint32_t>(most / own) : level_q15;
}

int32_t near_um(int32_t place_um) {
  if (place_um > kFarUm) return kFarUm;
  return place_um < -kFarUm ? -kFarUm : place_um;
}

// What the coils do at a finger's p-th point.
void read_point(const Table& table, Place middle, uint32_t p, PlaceResponses& found) {
  const Place place{near_um(middle.x_um) + kRing[p].x_um, near_um(middle.y_um) + kRing[p].y_um};
  table.responses_at(place, found);
}

}  // namespace

void FingerDrives::start(uint32_t channels) {
  channels_ = channels;
  stop();
}

void FingerDrives::stop() {
  stage_ = Stage::kDone;
  solved_ = 0;
  isolations_ = {};
  of_loudest_ = {};
  own_m_per_n_ = {};
}

void FingerDrives::ask(const Slots& slots, const Places& places) {
  asked_ = slots;
  places_ = places;
  filled_ = 0;
  solver_.set().count = 0;
  solved_ &= slots.there;
  stage_ = Stage::kFill;
}

bool FingerDrives::work(const Table& table) {
  if (!is_busy() || !table.has_responses()) return false;
  uint32_t left = kProductsOfATurn;
  for (;;) {
    const bool is_filling = stage_ == Stage::kFill;
    const uint32_t products = is_filling ? products_of_lookups() : solver_.next_products();
    if (products > left) return false;
    left -= products;
    if (!step(table)) return true;
  }
}

// False when all is done.
bool FingerDrives::step(const Table& table) {
  if (stage_ == Stage::kFill) {
    if (fill(table)) return true;
    begin(table);
    return is_busy();
  }
  if (solver_.step()) return true;
  take();
  stage_ = Stage::kDone;
  return false;
}

// What the coils do at the next finger's points; false when all have been read.
bool FingerDrives::fill(const Table& table) {
  while (filled_ < kMostFingers && (asked_.there >> filled_ & 1U) == 0) ++filled_;
  if (filled_ == kMostFingers) return false;
  fingers::FingerSet<float>& set = solver_.set();
  fingers::Finger<float>& finger = set.fingers[set.count];
  slots_[set.count++] = static_cast<uint8_t>(filled_);
  PlaceResponses found{};
  for (uint32_t p = 0; p < kPoints; ++p) {
    read_point(table, places_[filled_], p, found);
    for (uint32_t k = 0; k < channels_; ++k) finger.points[p][k] = number(found.coils[k]);
    if (p == 0) finger.own = number(found.own);
  }
  ++filled_;
  return true;
}

void FingerDrives::begin(const Table& table) {
  fingers::FingerSet<float>& set = solver_.set();
  set.channels = channels_;
  const ReckonedFinger known = table.finger();
  set.stiffness = number(known.stiffness);
  uint32_t at = 0;
  for (uint32_t row = 0; row < channels_; ++row) {
    for (uint32_t column = row; column < channels_; ++column) {
      set.coupling[at++] = number(table.coupling(row, column));
    }
  }
  const bool can_choose = known.full_force_n > 0.0F && known.threshold_m > 0.0F;
  for (uint32_t j = 0; j < set.count; ++j) {
    fingers::Finger<float>& finger = set.fingers[j];
    finger.level_n = can_choose ? known.full_force_n : 1.0F;
    if ((asked_.silent >> slots_[j] & 1U) != 0) finger.level_n = 0.0F;
    finger.is_real = (asked_.real >> slots_[j] & 1U) != 0;
    finger.threshold_m = known.threshold_m * kExpectedToReal;
    finger.regularisation = can_choose ? 0.0F : fingers::kRegularisation;
  }
  stage_ = solver_.begin() ? Stage::kSolve : Stage::kDone;
}

uint32_t FingerDrives::level_within(const Reach& reach, uint32_t level_q15, uint32_t slot) const {
  return limited(reach, level_q15, own_m_per_n_[slot]);
}

uint32_t FingerDrives::level_within(const Reach& reach, uint32_t level_q15, const Drive& drive,
                                    Place middle, const Table& table) const {
  return limited(reach, level_q15, own_m_per_n(drive, middle, table));
}

// It pushes back as much as it moves: u = h̄ d / (1 + Z g).
float FingerDrives::own_m_per_n(const Drive& drive, Place middle, const Table& table) const {
  if (!table.has_responses()) return 0.0F;
  fingers::Complex<float> moved{}, pushed{1.0F, 0.0F};
  PlaceResponses found{};
  for (uint32_t p = 0; p < kPoints; ++p) {
    read_point(table, middle, p, found);
    if (p == 0) fingers::add_product(pushed, number(table.finger().stiffness), number(found.own));
    const float weight = p == 0 ? fingers::kCentreWeight : fingers::kRingWeight;
    for (uint32_t k = 0; k < channels_; ++k) {
      const fingers::Complex<float> gain{static_cast<float>(drive[k].in_phase_q15),
                                         static_cast<float>(drive[k].quadrature_q15)};
      fingers::add_product(moved, number(found.coils[k]) * weight, gain);
    }
  }
  const float stiff = fingers::squared(pushed);
  if (!(stiff > fingers::kLeast)) return 0.0F;
  return fingers::root(fingers::squared(moved) / stiff) / 32767.0F;
}

void FingerDrives::take() {
  solved_ = 0;
  isolations_ = {};
  of_loudest_ = {};
  own_m_per_n_ = {};
  for (uint32_t j = 0; j < solver_.set().count; ++j) take_one(j, slots_[j]);
}

void FingerDrives::take_one(uint32_t finger, uint32_t slot) {
  const fingers::FingerDrive<float>& found = solver_.drive(finger);
  for (uint32_t k = 0; k < channels_; ++k) {
    drives_[slot][k] = {rounded_q15(found.gains[k].re), rounded_q15(found.gains[k].im)};
  }
  float most = 0.0F;
  for (uint32_t j = 0; j < solver_.set().count; ++j) {
    if (j != finger && found.shares[j] > most) most = found.shares[j];
  }
  solved_ |= 1U << slot;
  own_m_per_n_[slot] = fingers::root(fingers::squared(found.means[finger]));
  of_loudest_[slot] = whole(1000.0F * found.of_loudest);
  if (most > 0.0F) isolations_[slot] = isolation_steps(found.shares[finger] / most);
}

}  // namespace chladni
