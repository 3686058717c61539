#include "core/table.hpp"

#include "core/bytes.hpp"
#include "core/flash_crc.hpp"

namespace chladni {

namespace {

namespace f = table_format;

// Ends a list of channels. An Xtensa compares with 16 at no cost, and with few other numbers.
constexpr uint8_t kNobody = 16;
static_assert(kNobody >= f::kMaxActuators, "a channel's number");
static_assert(f::kMaxActuators == kMaxChannels, "tables and synthesis disagree");

// Nibble k of the eight bytes is the actuator that stands in for k. False unless that is an order
// which undoes itself.
bool read_order(const uint8_t* bytes, uint32_t actuators,
                std::array<uint8_t, f::kMaxActuators>& order) {
  for (uint32_t k = 0; k < f::kMaxActuators; ++k) {
    order[k] = static_cast<uint8_t>((bytes[k / 2] >> (4 * (k % 2))) & 15U);
    if (k < actuators ? order[k] >= actuators : order[k] != 0) return false;
  }
  for (uint32_t k = 0; k < actuators; ++k) {
    if (order[order[k]] != k) return false;
  }
  return true;
}

bool is_zero(const uint8_t* bytes, uint32_t count) {
  for (uint32_t k = 0; k < count; ++k) {
    if (bytes[k] != 0) return false;
  }
  return true;
}

bool is_blank(const std::array<uint8_t, f::kHeaderBytes>& header) {
  for (const uint8_t byte : header) {
    if (byte != 0xFF) return false;
  }
  return true;
}

bool in_range(uint32_t value, uint32_t low, uint32_t high) { return value >= low && value <= high; }

bool is_name(const uint8_t* name) {
  if (name[f::kBoardNameBytes - 1] != 0) return false;
  uint32_t length = f::kBoardNameBytes;
  while (length > 0 && name[length - 1] == 0) --length;
  for (uint32_t k = 0; k < length; ++k) {
    if (name[k] < 0x20 || name[k] > 0x7E) return false;
  }
  return true;
}

using Corners = std::array<const Gain*, 4>;
using Weights = std::array<int32_t, 4>;  // in 1/65536

// Mixes gains, and hands that of stored channel k to the channel players[k], until that is nobody.
//
// A function of its own, not inlined: four pointers and four weights are about all an Xtensa's
// registers hold, and a loop that spills them takes half as long again.
[[gnu::noinline]] void mix_gains(const Corners& corners, const Weights& weights,
                                 const uint8_t* players, Gain* result) {
  const Gain *a = corners[0], *b = corners[1], *c = corners[2], *d = corners[3];
  const int32_t u = weights[0], v = weights[1], w = weights[2], z = weights[3];
  for (uint32_t player = *players; player != kNobody; player = *++players) {
    Gain& to = result[player];
    int32_t sum = u * a->in_phase_q15;
    sum += v * b->in_phase_q15;
    sum += w * c->in_phase_q15;
    sum += z * d->in_phase_q15;
    to.in_phase_q15 = static_cast<int16_t>(sum >> 16);
    sum = u * a++->quadrature_q15;
    sum += v * b++->quadrature_q15;
    sum += w * c++->quadrature_q15;
    sum += z * d++->quadrature_q15;
    to.quadrature_q15 = static_cast<int16_t>(sum >> 16);
  }
}

}  // namespace

TableStatus Table::load(const Hal& hal, uint32_t channels, uint32_t base) {
  is_loaded_ = false;
  base_ = base;
  TableStatus status = check(hal, channels);
  // Every section is decoded once, so that none can fail later; the first one stays.
  for (uint32_t section = sections_; status == TableStatus::kOk && section > 0; --section) {
    status = decode(hal, section - 1);
  }
  is_loaded_ = status == TableStatus::kOk;
  return status;
}

TableStatus Table::select(const Hal& hal, uint32_t frequency_mhz) {
  if (!is_loaded_) return TableStatus::kNone;
  for (uint32_t section = 0; section < sections_; ++section) {
    std::array<uint8_t, 4> bytes{};
    const uint32_t at = header_bytes_ + section * section_bytes_ + f::kSectionAtFrequencyMhz;
    if (!hal.read_flash(hal.context, FlashArea::kTables, base_ + at, bytes.data(), 4)) {
      is_loaded_ = false;
      return TableStatus::kReadFailed;
    }
    if (read_u32(bytes.data()) != frequency_mhz) continue;
    const TableStatus status = decode(hal, section);
    is_loaded_ = status == TableStatus::kOk;
    return status;
  }
  return TableStatus::kNoSection;
}

TableStatus Table::check(const Hal& hal, uint32_t channels) {
  sections_ = 0;
  std::array<uint8_t, f::kHeaderBytes> header{};
  if (!hal.read_flash(hal.context, FlashArea::kTables, base_, header.data(), f::kHeaderBytes)) {
    return TableStatus::kReadFailed;
  }
  const uint8_t* const h = header.data();
  if (is_blank(header)) return TableStatus::kNone;
  if (read_u32(h + f::kAtMagic) != f::kMagic) return TableStatus::kBadMagic;
  if (h[f::kAtVersionMajor] != f::kVersionMajor) return TableStatus::kBadVersion;
  total_bytes_ = read_u32(h + f::kAtTotalBytes);
  if (!in_range(total_bytes_, f::kHeaderBytes + f::kSectionBytes + f::kCrcBytes, f::kLargestFile)) {
    return TableStatus::kBadSize;
  }
  switch (check_flash_crc(hal, FlashArea::kTables, base_, total_bytes_, crc_)) {
    case FlashCrc::kRight: break;
    case FlashCrc::kWrong: return TableStatus::kBadCrc;
    case FlashCrc::kReadFailed: return TableStatus::kReadFailed;
  }
  static_assert(f::kAtBoardName == f::kAtBoardFingerprint + 8, "one stretch of bytes");
  for (uint32_t k = 0; k < kIdentityBytes; ++k) identity_[k] = h[f::kAtBoardFingerprint + k];
  header_bytes_ = read_u16(h + f::kAtHeaderBytes);
  section_bytes_ = h[f::kAtSectionBytes];
  const bool is_own = h[f::kAtVersionMinor] == f::kVersionMinor;
  if (header_bytes_ < f::kHeaderBytes || section_bytes_ < f::kSectionBytes ||
      (is_own && (header_bytes_ != f::kHeaderBytes || section_bytes_ != f::kSectionBytes))) {
    return TableStatus::kBadSize;
  }
  if (!take_header(h)) return TableStatus::kBadField;
  const uint32_t sections = h[f::kAtSections];
  if (!in_range(sections, 1, f::kMaxSections)) return TableStatus::kBadField;
  if (header_bytes_ + sections * section_bytes_ > total_bytes_ - f::kCrcBytes) {
    return TableStatus::kBadSize;
  }
  const uint32_t nodes = x_.nodes * y_.nodes;
  if (nodes > f::kMaxNodes || nodes > f::kMaxGains / actuators_) {
    return TableStatus::kTooLarge;
  }
  if (actuators_ != channels) return TableStatus::kWrongActuators;
  sections_ = sections;
  return TableStatus::kOk;
}

bool Table::take_header(const uint8_t* h) {
  const auto take_axis = [](uint32_t cells, uint32_t span_um, bool is_mirrored, Axis& axis) {
    if (!in_range(cells, 1, f::kMaxCellsPerSide) || !in_range(span_um, 1, f::kMaxSpanUm)) {
      return false;
    }
    uint32_t bits = 0;
    while ((cells >> bits) != 0) ++bits;
    // As large as 32 bits let it be: offsets are below the span, so offset * step is below 2^32.
    const uint32_t shift = 32U - f::kFractionBits - bits;
    axis.cells = cells;
    axis.half_um = span_um / 2;
    axis.last_um = span_um - 1;
    axis.fold_um = is_mirrored ? axis.last_um / 2 : axis.last_um;
    axis.step = (cells << (f::kFractionBits + shift)) / span_um;
    axis.shift = shift;
    axis.stored = is_mirrored ? (cells + 1) / 2 : cells;
    axis.nodes = axis.stored + 1;
    // Cells meet at the mirror unless the middle one of an odd number lies on it.
    axis.meets = is_mirrored && cells % 2 == 0;
    return true;
  };
  actuators_ = h[f::kAtActuators];
  const uint32_t mirrors = h[f::kAtMirrors];
  const bool is_mirrored_x = (mirrors & 1U) != 0, is_mirrored_y = (mirrors & 2U) != 0;
  ramp_us_ = read_u32(h + f::kAtRampUs);
  touch_timeout_us_ = read_u32(h + f::kAtTouchTimeoutUs);
  max_on_us_ = read_u32(h + f::kAtMaxOnUs);
  const bool fields_fit =
      in_range(actuators_, 1, f::kMaxActuators) && mirrors <= 3 &&
      take_axis(read_u16(h + f::kAtColumns), read_u32(h + f::kAtWidthUm), is_mirrored_x, x_) &&
      take_axis(read_u16(h + f::kAtRows), read_u32(h + f::kAtLengthUm), is_mirrored_y, y_) &&
      regions() <= f::kMaxRegions && in_range(ramp_us_, f::kMinRampUs, f::kMaxRampUs) &&
      in_range(touch_timeout_us_, f::kMinTouchTimeoutUs, f::kMaxTouchTimeoutUs) &&
      in_range(max_on_us_, f::kMinOnUs, f::kMaxOnUs) && is_name(h + f::kAtBoardName);
  if (!fields_fit) return false;
  std::array<uint8_t, f::kMaxActuators> identity{};
  for (uint32_t k = 0; k < f::kMaxActuators; ++k) identity[k] = static_cast<uint8_t>(k);
  orders_.fill(identity);
  const uint8_t* const mirror_x = h + f::kAtMirrorX;
  const uint8_t* const mirror_y = h + f::kAtMirrorY;
  const bool orders_fit =
      (is_mirrored_x ? read_order(mirror_x, actuators_, orders_[1]) : is_zero(mirror_x, 8)) &&
      (is_mirrored_y ? read_order(mirror_y, actuators_, orders_[2]) : is_zero(mirror_y, 8));
  if (!orders_fit) return false;
  for (uint32_t k = 0; k < actuators_; ++k) orders_[3][k] = orders_[1][orders_[2][k]];
  for (uint32_t flips = 0; flips < 4; ++flips) {
    players_[flips][actuators_] = kNobody;
    for (uint32_t k = 0; k < actuators_; ++k) {
      players_[flips][orders_[flips][k]] = static_cast<uint8_t>(k);
    }
  }
  x_.flip = 1;
  y_.flip = 2;
  return true;
}

TableStatus Table::decode(const Hal& hal, uint32_t section) {
  std::array<uint8_t, f::kSectionBytes> bytes{};
  const uint8_t* const h = bytes.data();
  const uint32_t at = header_bytes_ + section * section_bytes_;
  if (!hal.read_flash(hal.context, FlashArea::kTables, base_ + at, bytes.data(),
                      f::kSectionBytes)) {
    return TableStatus::kReadFailed;
  }
  const uint32_t offset = read_u32(h + f::kSectionAtOffset);
  const uint32_t count = read_u32(h + f::kSectionAtBytes);
  const uint32_t first = header_bytes_ + sections_ * section_bytes_;
  const uint32_t end = total_bytes_ - f::kCrcBytes;
  if (offset < first || offset > end || count > end - offset) return TableStatus::kBadSize;
  const uint32_t frequency_mhz = read_u32(h + f::kSectionAtFrequencyMhz);
  const SectionShape shape = {x_.stored,
                              y_.stored,
                              x_.nodes,
                              actuators_,
                              h[f::kSectionAtLabels],
                              h[f::kSectionAtStartShift]};
  if (!in_range(frequency_mhz, f::kMinFrequencyMhz, f::kMaxFrequencyMhz) ||
      read_u32(h + f::kSectionAtFullScaleGainMilli) == 0 ||
      h[f::kSectionAtObjective] > f::kLastObjective || shape.labels < 1 ||
      shape.labels > f::kMaxLabels || shape.start_shift > f::kMaxShift) {
    return TableStatus::kBadField;
  }
  StreamReader stream(hal, base_ + offset, count);
  switch (decode_section(stream, shape, drives_)) {
    case StreamReader::Status::kOk: break;
    case StreamReader::Status::kReadFailed: return TableStatus::kReadFailed;
    case StreamReader::Status::kDamaged: return TableStatus::kBadDrives;
  }
  add_images();
  frequency_mhz_ = frequency_mhz;
  return TableStatus::kOk;
}

// A column and a row more than are stored: the images that cells at a mirror are mixed with, or
// else the last cells once more, so that all is flat beyond their centres.
void Table::add_images() {
  const uint32_t last_x = x_.stored - 1, last_y = (y_.stored - 1) * x_.nodes;
  const uint32_t flip_x = x_.meets ? 1 : 0, flip_y = y_.meets ? 2 : 0;
  for (uint32_t row = 0; row < y_.stored; ++row) {
    add_image(row * x_.nodes + last_x, row * x_.nodes + x_.stored, flip_x);
  }
  for (uint32_t column = 0; column < x_.stored; ++column) {
    add_image(last_y + column, y_.stored * x_.nodes + column, flip_y);
  }
  add_image(last_y + last_x, y_.stored * x_.nodes + x_.stored, flip_x + flip_y);
}

void Table::add_image(uint32_t at, uint32_t image, uint32_t flips) {
  const uint8_t label = drives_.labels[at];
  drives_.labels[image] = ((drives_.cuts[label] >> flips) & 1U) != 0 ? kNoLabel : label;
  copy_image(at, flips, &drives_.gains[image * actuators_]);
}

// The drive of a cell as the flips make it.
void Table::copy_image(uint32_t at, uint32_t flips, Gain* to) const {
  const int32_t sign = is_negated(drives_.labels[at], flips) ? -1 : 1;
  for (uint32_t k = 0; k < actuators_; ++k) {
    const Gain& gain = drives_.gains[at * actuators_ + orders_[flips][k]];
    to[k] = {static_cast<int16_t>(sign * gain.in_phase_q15),
             static_cast<int16_t>(sign * gain.quadrature_q15)};
  }
}

bool Table::is_negated(uint8_t label, uint32_t flips) const {
  return ((drives_.negations[label] >> flips) & 1U) != 0;
}

inline uint32_t Table::offset(const Axis& axis, int32_t place_um) {
  // Unsigned, so that what lies below the lower edge is beyond the upper one too.
  const uint32_t from_edge = static_cast<uint32_t>(place_um) + axis.half_um;
  if (from_edge <= axis.last_um) return from_edge;
  return place_um < 0 ? 0 : axis.last_um;
}

inline uint32_t Table::position(const Axis& axis, uint32_t offset_um) {
  return (offset_um * axis.step) >> axis.shift;
}

inline Table::Span Table::span(const Axis& axis, int32_t place_um) {
  constexpr uint32_t kOne = 1U << f::kFractionBits;
  uint32_t from_edge = offset(axis, place_um), flip = 0;
  if (from_edge > axis.fold_um) {
    from_edge = axis.last_um - from_edge;
    flip = axis.flip;
  }
  const uint32_t at = position(axis, from_edge);
  // Beyond the outermost centres all is flat: here by holding on to them, at the other end because
  // the last cell stands there twice.
  const uint32_t inner = at > kOne / 2 ? at - kOne / 2 : 0;
  return {inner >> f::kFractionBits, static_cast<int32_t>(inner & (kOne - 1)), flip};
}

uint32_t Table::region_at(Place place) const {
  const uint32_t column = position(x_, offset(x_, place.x_um)) >> f::kFractionBits;
  const uint32_t row = position(y_, offset(y_, place.y_um)) >> f::kFractionBits;
  return row * x_.cells + column;
}

void Table::drive(uint32_t region, Drive& result) const {
  uint32_t column = region % x_.cells, row = region / x_.cells, flips = 0;
  if (column >= x_.stored) {
    column = x_.cells - 1 - column;
    flips = 1;
  }
  if (row >= y_.stored) {
    row = y_.cells - 1 - row;
    flips += 2;
  }
  copy_image(row * x_.nodes + column, flips, result.data());
}

void Table::drive_at(Place place, Drive& result) const {
  constexpr int32_t kOne = 1 << f::kFractionBits;
  const Span x = span(x_, place.x_um), y = span(y_, place.y_um);
  // Corners in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
  uint32_t at0 = y.low * x_.nodes + x.low, at1 = at0 + 1;
  uint32_t at2 = at0 + x_.nodes, at3 = at2 + 1;
  const uint8_t* const labels = drives_.labels.data();
  uint8_t label = labels[at0];
  if (label != labels[at1] || label != labels[at2] || label != labels[at3]) {
    // Only what carries the nearest corner's label takes part. Another gives way to the corner next
    // to it along x, or else along y, or else to the one opposite.
    label = labels[y.fraction < kOne / 2 ? (x.fraction < kOne / 2 ? at0 : at1)
                                         : (x.fraction < kOne / 2 ? at2 : at3)];
    const bool is0 = labels[at0] == label, is1 = labels[at1] == label;
    const bool is2 = labels[at2] == label, is3 = labels[at3] == label;
    const uint32_t own0 = at0, own1 = at1, own2 = at2, own3 = at3;
    if (!is0) at0 = is1 ? own1 : (is2 ? own2 : own3);
    if (!is1) at1 = is0 ? own0 : (is3 ? own3 : own2);
    if (!is2) at2 = is3 ? own3 : (is0 ? own0 : own1);
    if (!is3) at3 = is2 ? own2 : (is1 ? own1 : own0);
  }
  const uint32_t flips = x.flip + y.flip;
  const int32_t one = is_negated(label, flips) ? -kOne : kOne;
  const int32_t top = one * y.fraction, bottom = one * kOne - top;
  Weights weights;
  weights[1] = (bottom * x.fraction) >> f::kFractionBits;
  weights[0] = bottom - weights[1];
  weights[3] = (top * x.fraction) >> f::kFractionBits;
  weights[2] = top - weights[3];
  const Gain* const gains = drives_.gains.data();
  const Corners corners = {gains + at0 * actuators_, gains + at1 * actuators_,
                           gains + at2 * actuators_, gains + at3 * actuators_};
  mix_gains(corners, weights, players_[flips].data(), result.data());
}

}  // namespace chladni
