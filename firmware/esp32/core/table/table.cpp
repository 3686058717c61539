#include "core/table/table.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"
#include "core/table/stored_gains.hpp"

namespace chladni {

namespace {

namespace f = table_format;

static_assert(f::kMaxActuators == kMaxChannels, "tables and synthesis disagree");

bool is_all(const uint8_t* bytes, uint32_t count, uint8_t value) {
  for (uint32_t k = 0; k < count; ++k) {
    if (bytes[k] != value) return false;
  }
  return true;
}

bool in_range(uint32_t value, uint32_t low, uint32_t high) { return value >= low && value <= high; }

template <uint32_t kBits>
bool are_within_full_scale(const uint8_t* gains, uint32_t count) {
  const auto square = [](uint32_t code) {
    // Modulo 2^32 the square of a negative number is right, and two of 2^30 fit.
    const uint32_t value = (code - kZero<kBits>) << (16U - kBits);
    return value * value;
  };
  for (const uint8_t* const end = gains + count * kGainBytes<kBits>; gains != end;
       gains += kGainBytes<kBits>) {
    const Codes gain = codes_of<kBits>(gains);
    if (square(gain.in_phase) + square(gain.quadrature) > f::kFullScale * f::kFullScale) {
      return false;
    }
  }
  return true;
}

bool are_gains(const uint8_t* gains, uint32_t count, uint32_t bits) {
  if (bits == 8) return are_within_full_scale<8>(gains, count);
  return bits == 12 ? are_within_full_scale<12>(gains, count)
                    : are_within_full_scale<16>(gains, count);
}

}  // namespace

TableStatus Table::load(const Hal& hal, uint32_t channels, uint32_t base) {
  const TableStatus status = check(hal, channels, base);
  is_loaded_ = status == TableStatus::kOk;
  if (is_loaded_) select(view(f::kHeaderBytes).frequency_millihertz);
  return status;
}

TableStatus Table::select(uint32_t frequency_millihertz) {
  if (!is_loaded_) return TableStatus::kNone;
  SectionView drives{}, responses{};
  uint32_t at = f::kHeaderBytes;
  for (uint32_t section = 0; section < sections_; ++section, at += section_bytes(at)) {
    const SectionView own = view(at);
    if (own.frequency_millihertz != frequency_millihertz) continue;
    SectionView& found = own.are_responses ? responses : drives;
    if (found.records == nullptr) found = own;
  }
  if (drives.records == nullptr && responses.records == nullptr) return TableStatus::kNoSection;
  frequency_millihertz_ = frequency_millihertz;
  crossings_ = drives.head;
  records_ = drives.records;
  responses_head_ = responses.head;
  responses_ = responses.records;
  full_scale_pm_ = responses.full_scale;
  return TableStatus::kOk;
}

Table::SectionView Table::view(uint32_t at) const {
  const uint8_t* const header = bytes_ + at;
  const uint8_t* const head = header + f::kSectionBytes;
  const bool are_responses = header[f::kSectionAtObjective] == f::kResponses;
  const uint32_t bytes =
      are_responses ? f::kResponsesHeadBytes + coupling_bytes() : header[f::kSectionAtLabels];
  return {read_u32(header + f::kSectionAtFrequencyMillihertz),
          read_u32(header + f::kSectionAtFullScale), are_responses, head, head + bytes};
}

uint32_t Table::section_bytes(uint32_t at) const {
  const SectionView section = view(at);
  const uint32_t record = section.are_responses ? response_bytes_ : record_bytes_;
  return static_cast<uint32_t>(section.records - (bytes_ + at)) + cells_ * record;
}

uint32_t Table::coupling_bytes() const {
  return f::kCouplingBytes * (actuators_ * (actuators_ + 1) / 2);
}

TableStatus Table::check_kind(const uint8_t* h) {
  if (read_u32(h + f::kAtMagic) != f::kMagic) return TableStatus::kBadMagic;
  const uint32_t minor = h[f::kAtVersionMinor];
  const bool is_known = h[f::kAtVersionMajor] == f::kVersionMajor &&
                        (minor == f::kVersionMinor || minor == f::kDrivesMinor);
  return is_known ? TableStatus::kOk : TableStatus::kBadVersion;
}

TableStatus Table::check_head(const uint8_t* header, uint32_t total_bytes, uint32_t channels) {
  const TableStatus kind = check_kind(header);
  if (kind != TableStatus::kOk) return kind;
  const uint32_t total = read_u32(header + f::kAtTotalBytes);
  if (total != total_bytes || !in_range(total, f::kSmallestFile, f::kLargestFile)) {
    return TableStatus::kBadSize;
  }
  Table found;
  if (!found.take_header(header)) return TableStatus::kBadField;
  return found.actuators_ == channels ? TableStatus::kOk : TableStatus::kWrongActuators;
}

bool Table::is_intact() const {
  const uint32_t covered = total_bytes_ - f::kCrcBytes;
  return crc32(bytes_, covered) == crc_ && read_u32(bytes_ + covered) == crc_;
}

Place Table::on_board(Place place) const {
  const auto clamp = [](int32_t value, const Axis& axis) {
    const auto low = -static_cast<int32_t>(axis.half_um);
    const auto high = static_cast<int32_t>(axis.last_um) + low;
    return value < low ? low : (value > high ? high : value);
  };
  return {clamp(place.x_um, x_), clamp(place.y_um, y_)};
}

TableStatus Table::check(const Hal& hal, uint32_t channels, uint32_t base) {
  const auto map = [&](uint32_t count) {
    return hal.map_flash(hal.context, FlashArea::kTables, base, count);
  };
  const uint8_t* const h = map(f::kHeaderBytes);
  if (h == nullptr) return TableStatus::kReadFailed;
  if (is_all(h, f::kHeaderBytes, 0xFF)) return TableStatus::kNone;
  const TableStatus kind = check_kind(h);
  if (kind != TableStatus::kOk) return kind;
  total_bytes_ = read_u32(h + f::kAtTotalBytes);
  if (!in_range(total_bytes_, f::kSmallestFile, f::kLargestFile)) return TableStatus::kBadSize;
  bytes_ = map(total_bytes_);
  if (bytes_ == nullptr) return TableStatus::kBadSize;
  const uint32_t covered = total_bytes_ - f::kCrcBytes;
  crc_ = crc32(bytes_, covered);
  if (read_u32(bytes_ + covered) != crc_) return TableStatus::kBadCrc;
  if (!take_header(bytes_)) return TableStatus::kBadField;
  const TableStatus status = check_sections();
  if (status != TableStatus::kOk) return status;
  return actuators_ == channels ? TableStatus::kOk : TableStatus::kWrongActuators;
}

bool Table::take_axis(const uint8_t* h, uint32_t at_cells, uint32_t at_span, uint32_t flip,
                      Axis& axis) {
  const uint32_t cells = read_u16(h + at_cells), span_um = read_u32(h + at_span);
  if (!in_range(cells, 1, f::kMaxCellsPerSide) || !in_range(span_um, 1, f::kMaxSpanUm)) {
    return false;
  }
  uint32_t bits = 0;
  while ((cells >> bits) != 0) ++bits;
  const bool is_mirrored = (h[f::kAtMirrors] & flip) != 0;
  axis.half_um = span_um / 2;
  axis.last_um = span_um - 1;
  axis.fold_um = is_mirrored ? axis.last_um / 2 : axis.last_um;
  axis.flip = flip;
  // As large as 32 bits let it be: offsets are below the span, so offset * step is below 2^32.
  axis.shift = 32U - f::kFractionBits - bits;
  axis.step = (cells << (f::kFractionBits + axis.shift)) / span_um;
  axis.last = (is_mirrored ? (cells + 1) / 2 : cells) - 1;
  // Cells meet at the mirror unless the middle one of an odd number lies on it.
  axis.beyond = is_mirrored && cells % 2 == 0 ? flip : 0;
  return true;
}

bool Table::take_header(const uint8_t* h) {
  minor_ = h[f::kAtVersionMinor];
  actuators_ = h[f::kAtActuators];
  bits_ = h[f::kAtBits];
  sections_ = h[f::kAtSections];
  if (!in_range(actuators_, 1, f::kMaxActuators) || !in_range(sections_, 1, f::kMaxSections) ||
      (bits_ != 8 && bits_ != 12 && bits_ != 16) || read_u16(h + f::kAtReserved) != 0) {
    return false;
  }
  record_bytes_ = 1 + actuators_ * (bits_ / 4);
  response_bytes_ = (actuators_ + 1) * (bits_ / 4);
  const uint32_t mirrors = h[f::kAtMirrors];
  ramp_us_ = read_u32(h + f::kAtRampUs);
  touch_timeout_us_ = read_u32(h + f::kAtTouchTimeoutUs);
  max_on_us_ = read_u32(h + f::kAtMaxOnUs);
  const bool fields_fit =
      mirrors <= 3 && take_axis(h, f::kAtColumns, f::kAtWidthUm, 1, x_) &&
      take_axis(h, f::kAtRows, f::kAtLengthUm, 2, y_) &&
      in_range(ramp_us_, f::kMinRampUs, f::kMaxRampUs) &&
      in_range(touch_timeout_us_, f::kMinTouchTimeoutUs, f::kMaxTouchTimeoutUs) &&
      in_range(max_on_us_, f::kMinOnUs, f::kMaxOnUs) &&
      is_name(h + f::kAtBoardName, f::kBoardNameBytes);
  if (!fields_fit) return false;
  x_.to_next = record_bytes_;
  y_.to_next = record_bytes_ * (x_.last + 1);
  x_.responses_to_next = response_bytes_;
  y_.responses_to_next = response_bytes_ * (x_.last + 1);
  cells_ = (x_.last + 1) * (y_.last + 1);
  Orders orders{};
  if (!read_orders(h + f::kAtMirrorX, h + f::kAtMirrorY, mirrors, actuators_, orders)) return false;
  find_sources(orders, actuators_, bits_ / 4, sources_);
  return true;
}

TableStatus Table::check_sections() const {
  uint32_t at = f::kHeaderBytes;
  bool after_responses = false;
  for (uint32_t section = 0; section < sections_; ++section) {
    const TableStatus status = check_section(at, after_responses);
    if (status != TableStatus::kOk) return status;
  }
  return at == total_bytes_ - f::kCrcBytes ? TableStatus::kOk : TableStatus::kBadSize;
}

TableStatus Table::check_section(uint32_t& at, bool& after_responses) const {
  const uint32_t end = total_bytes_ - f::kCrcBytes;
  if (end - at < f::kSectionBytes) return TableStatus::kBadSize;
  const uint8_t* const header = bytes_ + at;
  const SectionView section = view(at);
  const uint32_t labels = header[f::kSectionAtLabels];
  const bool is_kind = section.are_responses
                           ? labels == 0 && minor_ != f::kDrivesMinor
                           : in_range(labels, 1, f::kMaxLabels) && !after_responses &&
                                 header[f::kSectionAtObjective] < f::kResponses;
  if (!in_range(section.frequency_millihertz, f::kMinFrequencyMillihertz,
                f::kMaxFrequencyMillihertz) ||
      section.full_scale == 0 || !is_kind || read_u16(header + f::kSectionAtReserved) != 0) {
    return TableStatus::kBadField;
  }
  const uint32_t bytes = section_bytes(at);
  if (end - at < bytes) return TableStatus::kBadSize;
  after_responses = section.are_responses;
  at += bytes;
  return section.are_responses ? check_responses(section) : check_drives(section, labels);
}

TableStatus Table::check_drives(const SectionView& section, uint32_t labels) const {
  for (uint32_t label = 0; label < labels; ++label) {
    if (!is_crossing(section.head[label])) return TableStatus::kBadDrives;
  }
  const uint8_t* record = section.records;
  for (uint32_t cell = 0; cell < cells_; ++cell, record += record_bytes_) {
    if (record[0] >= labels || !are_gains(record + 1, actuators_, bits_)) {
      return TableStatus::kBadDrives;
    }
  }
  return TableStatus::kOk;
}

TableStatus Table::check_responses(const SectionView& section) const {
  if (read_u32(section.head + f::kResponsesAtOwnFullScale) == 0) return TableStatus::kBadField;
  // From there on all are floats.
  for (const uint8_t* at = section.head + f::kResponsesAtStiffness; at != section.records;
       at += 4) {
    // NaN and infinity have an exponent of ones.
    constexpr uint32_t kExponent = 0x7F800000U;
    if ((read_u32(at) & kExponent) == kExponent) return TableStatus::kBadDrives;
  }
  return are_gains(section.records, cells_ * (actuators_ + 1), bits_) ? TableStatus::kOk
                                                                      : TableStatus::kBadDrives;
}

}  // namespace chladni
