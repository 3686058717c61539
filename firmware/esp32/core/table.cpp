#include "core/table.hpp"

#include "core/crc32.hpp"

namespace chladni {

namespace {

namespace f = table_format;

constexpr uint32_t kChunkBytes = 256;
static_assert(f::kMaxActuators == kMaxChannels, "tables and synthesis disagree");

uint32_t read_u16(const uint8_t* bytes) {
  return static_cast<uint32_t>(bytes[0]) | (static_cast<uint32_t>(bytes[1]) << 8);
}

uint32_t read_u32(const uint8_t* bytes) { return read_u16(bytes) | (read_u16(bytes + 2) << 16); }

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

}  // namespace

const char* to_text(TableStatus status) {
  switch (status) {
    case TableStatus::kOk: return "ok";
    case TableStatus::kNone: return "no table";
    case TableStatus::kReadFailed: return "flash could not be read";
    case TableStatus::kBadMagic: return "not a table";
    case TableStatus::kBadVersion: return "unknown table version";
    case TableStatus::kBadSize: return "table sizes contradict each other";
    case TableStatus::kBadCrc: return "table is damaged";
    case TableStatus::kBadField: return "table header out of range";
    case TableStatus::kBadDrives: return "table drives cannot be decoded";
    case TableStatus::kTooLarge: return "table too large";
    case TableStatus::kWrongActuators: return "table is for another number of actuators";
    case TableStatus::kNoSection: return "no drives for that frequency";
  }
  return "unknown";
}

TableStatus Table::load(const Hal& hal, uint32_t channels) {
  is_loaded_ = false;
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
    if (!hal.read_table(hal.context, at, bytes.data(), 4)) {
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
  if (!hal.read_table(hal.context, 0, header.data(), f::kHeaderBytes)) {
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
  const TableStatus status = check_crc(hal, total_bytes_);
  if (status != TableStatus::kOk) return status;
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
  if (x_.stored * y_.stored > f::kMaxStored || x_.stored * y_.stored > f::kMaxGains / actuators_) {
    return TableStatus::kTooLarge;
  }
  if (actuators_ != channels) return TableStatus::kWrongActuators;
  sections_ = sections;
  return TableStatus::kOk;
}

TableStatus Table::check_crc(const Hal& hal, uint32_t total_bytes) const {
  std::array<uint8_t, kChunkBytes> chunk{};
  uint32_t running = kCrc32Start;
  const uint32_t covered = total_bytes - f::kCrcBytes;
  for (uint32_t done = 0; done < covered;) {
    const uint32_t count = covered - done < kChunkBytes ? covered - done : kChunkBytes;
    if (!hal.read_table(hal.context, done, chunk.data(), count)) return TableStatus::kReadFailed;
    running = crc32_feed(running, chunk.data(), count);
    done += count;
  }
  if (!hal.read_table(hal.context, covered, chunk.data(), f::kCrcBytes)) {
    return TableStatus::kReadFailed;
  }
  return read_u32(chunk.data()) == (running ^ 0xFFFFFFFFU) ? TableStatus::kOk
                                                           : TableStatus::kBadCrc;
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
    axis = {cells,
            static_cast<int32_t>(span_um),
            (cells << (f::kFractionBits + shift)) / span_um,
            shift,
            is_mirrored ? (cells + 1) / 2 : cells,
            is_mirrored};
    return true;
  };
  actuators_ = h[f::kAtActuators];
  const uint32_t mirrors = h[f::kAtMirrors];
  ramp_us_ = read_u32(h + f::kAtRampUs);
  touch_timeout_us_ = read_u32(h + f::kAtTouchTimeoutUs);
  max_on_us_ = read_u32(h + f::kAtMaxOnUs);
  const bool fields_fit =
      in_range(actuators_, 1, f::kMaxActuators) && mirrors <= 3 &&
      take_axis(read_u16(h + f::kAtColumns), read_u32(h + f::kAtWidthUm), (mirrors & 1U) != 0,
                x_) &&
      take_axis(read_u16(h + f::kAtRows), read_u32(h + f::kAtLengthUm), (mirrors & 2U) != 0, y_) &&
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
      (x_.is_mirrored ? read_order(mirror_x, actuators_, orders_[1]) : is_zero(mirror_x, 8)) &&
      (y_.is_mirrored ? read_order(mirror_y, actuators_, orders_[2]) : is_zero(mirror_y, 8));
  if (!orders_fit) return false;
  for (uint32_t k = 0; k < actuators_; ++k) orders_[3][k] = orders_[1][orders_[2][k]];
  return true;
}

TableStatus Table::decode(const Hal& hal, uint32_t section) {
  std::array<uint8_t, f::kSectionBytes> bytes{};
  const uint8_t* const h = bytes.data();
  const uint32_t at = header_bytes_ + section * section_bytes_;
  if (!hal.read_table(hal.context, at, bytes.data(), f::kSectionBytes)) {
    return TableStatus::kReadFailed;
  }
  const uint32_t offset = read_u32(h + f::kSectionAtOffset);
  const uint32_t count = read_u32(h + f::kSectionAtBytes);
  const uint32_t first = header_bytes_ + sections_ * section_bytes_;
  const uint32_t end = total_bytes_ - f::kCrcBytes;
  if (offset < first || offset > end || count > end - offset) return TableStatus::kBadSize;
  const uint32_t frequency_mhz = read_u32(h + f::kSectionAtFrequencyMhz);
  const SectionShape shape = {x_.stored, y_.stored, actuators_, h[f::kSectionAtLabels],
                              h[f::kSectionAtStartShift]};
  if (!in_range(frequency_mhz, f::kMinFrequencyMhz, f::kMaxFrequencyMhz) ||
      read_u32(h + f::kSectionAtFullScaleGainMilli) == 0 ||
      h[f::kSectionAtObjective] > f::kLastObjective || shape.labels < 1 ||
      shape.labels > f::kMaxLabels || shape.start_shift > f::kMaxShift) {
    return TableStatus::kBadField;
  }
  StreamReader stream(hal, offset, count);
  switch (decode_section(stream, shape, drives_)) {
    case StreamReader::Status::kOk: break;
    case StreamReader::Status::kReadFailed: return TableStatus::kReadFailed;
    case StreamReader::Status::kDamaged: return TableStatus::kBadDrives;
  }
  frequency_mhz_ = frequency_mhz;
  return TableStatus::kOk;
}

uint32_t Table::position(const Axis& axis, int32_t place_um) {
  // Twice the offset from the lower edge, so that an odd span needs no half micrometre. Places are
  // clamped first, so nothing below can leave 32 bits.
  const int32_t span = axis.span_um;
  const int32_t near = place_um < -span ? -span : (place_um > span ? span : place_um);
  int32_t doubled = 2 * near + span;
  if (doubled < 0) doubled = 0;
  if (doubled > 2 * span - 1) doubled = 2 * span - 1;
  return ((static_cast<uint32_t>(doubled) >> 1) * axis.step) >> axis.shift;
}

Table::Span Table::span(const Axis& axis, int32_t place_um) {
  constexpr uint32_t kOne = 1U << f::kFractionBits;
  const uint32_t at = position(axis, place_um);
  // Beyond the outermost centres all is flat.
  if (at < kOne / 2) return {0, 0, 0};
  const uint32_t beyond = at - kOne / 2, low = beyond >> f::kFractionBits;
  if (low + 1 >= axis.cells) return {axis.cells - 1, axis.cells - 1, 0};
  return {low, low + 1, beyond & (kOne - 1)};
}

Table::Cell Table::cell(uint32_t column, uint32_t row) const {
  uint32_t flips = 0;
  if (column >= x_.stored) {
    column = x_.cells - 1 - column;
    flips = 1;
  }
  if (row >= y_.stored) {
    row = y_.cells - 1 - row;
    flips |= 2;
  }
  return {row * x_.stored + column, flips};
}

bool Table::is_negated(const Cell& cell) const {
  const LabelCrossings& own = drives_.crossings[drives_.labels[cell.stored]];
  const bool in_x = (cell.flips & 1U) != 0 && own.x == Crossing::kNegated;
  const bool in_y = (cell.flips & 2U) != 0 && own.y == Crossing::kNegated;
  return in_x != in_y;
}

void Table::add(const Cell& cell, int32_t weight,
                std::array<std::array<int32_t, 2>, kMaxChannels>& sum) const {
  const uint8_t* const order = orders_[cell.flips].data();
  const Gain* const gains = &drives_.gains[cell.stored * actuators_];
  if (cell.flips != 0 && is_negated(cell)) weight = -weight;
  for (uint32_t k = 0; k < actuators_; ++k) {
    const Gain& gain = gains[order[k]];
    sum[k][0] += weight * gain.in_phase_q15;
    sum[k][1] += weight * gain.quadrature_q15;
  }
}

uint32_t Table::region_at(Place place) const {
  const uint32_t column = position(x_, place.x_um) >> f::kFractionBits;
  const uint32_t row = position(y_, place.y_um) >> f::kFractionBits;
  return row * x_.cells + column;
}

Drive Table::drive(uint32_t region) const {
  const Cell own = cell(region % x_.cells, region / x_.cells);
  std::array<std::array<int32_t, 2>, kMaxChannels> sum{};
  add(own, 1, sum);
  Drive result{};
  for (uint32_t k = 0; k < actuators_; ++k) {
    result[k] = {static_cast<int16_t>(sum[k][0]), static_cast<int16_t>(sum[k][1])};
  }
  return result;
}

Drive Table::drive_at(Place place) const {
  constexpr uint32_t kOne = 1U << f::kFractionBits;
  const Span x = span(x_, place.x_um), y = span(y_, place.y_um);
  // Corners in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
  const std::array<Cell, 4> cells = {cell(x.low, y.low), cell(x.high, y.low), cell(x.low, y.high),
                                     cell(x.high, y.high)};
  const uint32_t right = x.fraction, up = y.fraction;
  std::array<uint32_t, 4> weights = {(kOne - right) * (kOne - up), right * (kOne - up),
                                     (kOne - right) * up, right * up};
  const uint32_t nearest = (right >= kOne / 2 ? 1U : 0U) + (up >= kOne / 2 ? 2U : 0U);
  const uint8_t label = drives_.labels[cells[nearest].stored];
  // Flips that a corner may differ in from the nearest one.
  const LabelCrossings crossing = drives_.crossings[label];
  const uint32_t crossed =
      (crossing.x != Crossing::kCut ? 1U : 0U) + (crossing.y != Crossing::kCut ? 2U : 0U);
  std::array<bool, 4> is_member{};
  for (uint32_t k = 0; k < 4; ++k) {
    is_member[k] = drives_.labels[cells[k].stored] == label &&
                   ((cells[k].flips ^ cells[nearest].flips) & ~crossed) == 0;
  }
  // What lies beyond a cut gives its weight to the corners next to it, or to the one opposite.
  for (uint32_t k = 0; k < 4; ++k) {
    if (is_member[k]) continue;
    const uint32_t one = k ^ 1U, other = k ^ 2U, half = weights[k] >> 1;
    if (is_member[one] && is_member[other]) {
      weights[one] += half;
      weights[other] += weights[k] - half;
    } else {
      weights[is_member[one] ? one : (is_member[other] ? other : k ^ 3U)] += weights[k];
    }
  }
  std::array<std::array<int32_t, 2>, kMaxChannels> sum{};
  for (uint32_t k = 0; k < 4; ++k) {
    if (is_member[k]) add(cells[k], static_cast<int32_t>(weights[k]), sum);
  }
  Drive result{};
  for (uint32_t k = 0; k < actuators_; ++k) {
    result[k] = {static_cast<int16_t>((sum[k][0] + 32768) >> 16),
                 static_cast<int16_t>((sum[k][1] + 32768) >> 16)};
  }
  return result;
}

}  // namespace chladni
