#include "core/table/table.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

namespace f = table_format;

static_assert(f::kMaxActuators == kMaxChannels, "tables and synthesis disagree");

constexpr uint32_t kNoLabel = f::kMaxLabels;  // labels lie below it

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

bool is_all(const uint8_t* bytes, uint32_t count, uint8_t value) {
  for (uint32_t k = 0; k < count; ++k) {
    if (bytes[k] != value) return false;
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

// What becomes of a label across the mirrors, two bits each, x lower: it is cut there, or it goes
// on with the other sign.
constexpr uint32_t kNegatedShift = 2;
bool is_crossing(uint8_t code) { return code < 16 && (code & (code >> kNegatedShift)) == 0; }
constexpr uint8_t kCutX = 1, kCutY = 2;
uint32_t negations_of(uint8_t code) { return code >> kNegatedShift; }

// A gain's two integers as they are stored: the upper bits of a wider one, in offset binary, so
// that no sign has to be extended.
template <uint32_t kBits>
constexpr uint32_t kGainBytes = kBits / 4;
template <uint32_t kBits>
constexpr uint32_t kZero = 1U << (kBits - 1);

struct Codes {
  uint32_t in_phase;
  uint32_t quadrature;
};

template <uint32_t kBits>
inline Codes codes_of(const uint8_t* p) {
  if constexpr (kBits == 8) return {p[0], p[1]};
  if constexpr (kBits == 16) return {read_u16(p), read_u16(p + 2)};
  const uint32_t lower = p[2];
  return {static_cast<uint32_t>(p[0]) << 4 | (lower & 15U),
          static_cast<uint32_t>(p[1]) << 4 | lower >> 4};
}

// Four corners around a place, in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
struct Mix {
  std::array<const uint8_t*, 4> records;
  std::array<uint32_t, 4> weights;        // in 1/65536; a negative one wraps around
  const std::array<uint8_t, 4>* sources;  // of the channels, up to a zero
};

// Mixes the gains of all channels that there are sources for.
//
// A function of its own, not inlined: four pointers and four weights are about all an Xtensa's
// registers hold, and a loop that spills them takes half as long again.
template <uint32_t kBits>
[[gnu::noinline]] void mix_gains(const Mix& mix, Gain* result) {
  const uint8_t *const a = mix.records[0], *const b = mix.records[1];
  const uint8_t *const c = mix.records[2], *const d = mix.records[3];
  const uint32_t u = mix.weights[0], v = mix.weights[1];
  const uint32_t w = mix.weights[2], z = mix.weights[3];
  // Sums are right modulo 2^32 and end within 2^31.
  const uint32_t zero = kZero<kBits> * (u + v + w + z);
  const std::array<uint8_t, 4>* sources = mix.sources;
  for (uint32_t first = (*sources)[0]; first != 0; first = (*++sources)[0], ++result) {
    Codes gain = codes_of<kBits>(a + first);
    uint32_t in_phase = u * gain.in_phase - zero, quadrature = u * gain.quadrature - zero;
    gain = codes_of<kBits>(b + (*sources)[1]);
    in_phase += v * gain.in_phase;
    quadrature += v * gain.quadrature;
    gain = codes_of<kBits>(c + (*sources)[2]);
    in_phase += w * gain.in_phase;
    quadrature += w * gain.quadrature;
    gain = codes_of<kBits>(d + (*sources)[3]);
    in_phase += z * gain.in_phase;
    quadrature += z * gain.quadrature;
    // Sixteen bits of weight, less those that the integers lack of Q15.
    result->in_phase_q15 = static_cast<int16_t>(static_cast<int32_t>(in_phase) >> kBits);
    result->quadrature_q15 = static_cast<int16_t>(static_cast<int32_t>(quadrature) >> kBits);
  }
}

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

bool is_record(const uint8_t* record, uint32_t labels, uint32_t actuators, uint32_t bits) {
  if (record[0] >= labels) return false;
  if (bits == 8) return are_within_full_scale<8>(record + 1, actuators);
  return bits == 12 ? are_within_full_scale<12>(record + 1, actuators)
                    : are_within_full_scale<16>(record + 1, actuators);
}

}  // namespace

TableStatus Table::load(const Hal& hal, uint32_t channels, uint32_t base) {
  const TableStatus status = check(hal, channels, base);
  is_loaded_ = status == TableStatus::kOk;
  if (is_loaded_) use(f::kHeaderBytes);
  return status;
}

TableStatus Table::select(uint32_t frequency_mhz) {
  if (!is_loaded_) return TableStatus::kNone;
  uint32_t at = f::kHeaderBytes;
  for (uint32_t section = 0; section < sections_; ++section, at += section_bytes(at)) {
    if (view(at).frequency_mhz != frequency_mhz) continue;
    use(at);
    return TableStatus::kOk;
  }
  return TableStatus::kNoSection;
}

void Table::use(uint32_t at) {
  const SectionView section = view(at);
  frequency_mhz_ = section.frequency_mhz;
  crossings_ = section.crossings;
  records_ = section.records;
}

Table::SectionView Table::view(uint32_t at) const {
  const uint8_t* const header = bytes_ + at;
  const uint8_t* const crossings = header + f::kSectionBytes;
  return {read_u32(header + f::kSectionAtFrequencyMhz), crossings,
          crossings + header[f::kSectionAtLabels]};
}

uint32_t Table::section_bytes(uint32_t at) const {
  return f::kSectionBytes + bytes_[at + f::kSectionAtLabels] + cells_ * record_bytes_;
}

TableStatus Table::check(const Hal& hal, uint32_t channels, uint32_t base) {
  const auto map = [&](uint32_t count) {
    return hal.map_flash(hal.context, FlashArea::kTables, base, count);
  };
  const uint8_t* const h = map(f::kHeaderBytes);
  if (h == nullptr) return TableStatus::kReadFailed;
  if (is_all(h, f::kHeaderBytes, 0xFF)) return TableStatus::kNone;
  if (read_u32(h + f::kAtMagic) != f::kMagic) return TableStatus::kBadMagic;
  if (h[f::kAtVersionMajor] != f::kVersionMajor || h[f::kAtVersionMinor] != f::kVersionMinor) {
    return TableStatus::kBadVersion;
  }
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

bool Table::take_header(const uint8_t* h) {
  actuators_ = h[f::kAtActuators];
  bits_ = h[f::kAtBits];
  sections_ = h[f::kAtSections];
  if (!in_range(actuators_, 1, f::kMaxActuators) || !in_range(sections_, 1, f::kMaxSections) ||
      (bits_ != 8 && bits_ != 12 && bits_ != 16) || read_u16(h + f::kAtReserved) != 0) {
    return false;
  }
  record_bytes_ = 1 + actuators_ * (bits_ / 4);
  const uint32_t mirrors = h[f::kAtMirrors];
  const auto take_axis = [&](uint32_t at_cells, uint32_t at_span, uint32_t flip, Axis& axis) {
    const uint32_t cells = read_u16(h + at_cells), span_um = read_u32(h + at_span);
    if (!in_range(cells, 1, f::kMaxCellsPerSide) || !in_range(span_um, 1, f::kMaxSpanUm)) {
      return false;
    }
    uint32_t bits = 0;
    while ((cells >> bits) != 0) ++bits;
    const bool is_mirrored = (mirrors & flip) != 0;
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
  };
  ramp_us_ = read_u32(h + f::kAtRampUs);
  touch_timeout_us_ = read_u32(h + f::kAtTouchTimeoutUs);
  max_on_us_ = read_u32(h + f::kAtMaxOnUs);
  const bool fields_fit =
      mirrors <= 3 && take_axis(f::kAtColumns, f::kAtWidthUm, 1, x_) &&
      take_axis(f::kAtRows, f::kAtLengthUm, 2, y_) &&
      in_range(ramp_us_, f::kMinRampUs, f::kMaxRampUs) &&
      in_range(touch_timeout_us_, f::kMinTouchTimeoutUs, f::kMaxTouchTimeoutUs) &&
      in_range(max_on_us_, f::kMinOnUs, f::kMaxOnUs) && is_name(h + f::kAtBoardName);
  if (!fields_fit) return false;
  x_.to_next = record_bytes_;
  y_.to_next = record_bytes_ * (x_.last + 1);
  cells_ = (x_.last + 1) * (y_.last + 1);
  Orders orders{};
  for (uint32_t k = 0; k < f::kMaxActuators; ++k) orders[0][k] = static_cast<uint8_t>(k);
  orders[1] = orders[2] = orders[0];
  const uint8_t* const mirror_x = h + f::kAtMirrorX;
  const uint8_t* const mirror_y = h + f::kAtMirrorY;
  const bool orders_fit =
      ((mirrors & 1U) != 0 ? read_order(mirror_x, actuators_, orders[1])
                           : is_all(mirror_x, 8, 0)) &&
      ((mirrors & 2U) != 0 ? read_order(mirror_y, actuators_, orders[2]) : is_all(mirror_y, 8, 0));
  if (!orders_fit) return false;
  for (uint32_t k = 0; k < actuators_; ++k) orders[3][k] = orders[1][orders[2][k]];
  take_mirrors(orders);
  return true;
}

// The order of a corner's image, after that of the place's: a gain's place behind the label.
void Table::take_mirrors(const Orders& orders) {
  sources_ = {};
  for (uint32_t images = 0; images < 4; ++images) {
    for (uint32_t flips = 0; flips < 4; ++flips) {
      for (uint32_t k = 0; k < actuators_; ++k) {
        for (uint32_t corner = 0; corner < 4; ++corner) {
          const uint32_t stored = orders[images & corner][orders[flips][k]];
          sources_[images][flips][k][corner] = static_cast<uint8_t>(1 + stored * (bits_ / 4));
        }
      }
    }
  }
}

TableStatus Table::check_sections() const {
  uint32_t at = f::kHeaderBytes;
  for (uint32_t section = 0; section < sections_; ++section) {
    const TableStatus status = check_section(at);
    if (status != TableStatus::kOk) return status;
  }
  return at == total_bytes_ - f::kCrcBytes ? TableStatus::kOk : TableStatus::kBadSize;
}

TableStatus Table::check_section(uint32_t& at) const {
  const uint32_t end = total_bytes_ - f::kCrcBytes;
  if (end - at < f::kSectionBytes) return TableStatus::kBadSize;
  const uint8_t* const header = bytes_ + at;
  const SectionView section = view(at);
  const uint32_t labels = header[f::kSectionAtLabels];
  if (!in_range(section.frequency_mhz, f::kMinFrequencyMhz, f::kMaxFrequencyMhz) ||
      read_u32(header + f::kSectionAtFullScaleGainMilli) == 0 ||
      header[f::kSectionAtObjective] > f::kLastObjective || !in_range(labels, 1, f::kMaxLabels) ||
      read_u16(header + f::kSectionAtReserved) != 0) {
    return TableStatus::kBadField;
  }
  if (end - at < section_bytes(at)) return TableStatus::kBadSize;
  for (uint32_t label = 0; label < labels; ++label) {
    if (!is_crossing(section.crossings[label])) return TableStatus::kBadDrives;
  }
  const uint8_t* record = section.records;
  for (uint32_t cell = 0; cell < cells_; ++cell, record += record_bytes_) {
    if (!is_record(record, labels, actuators_, bits_)) return TableStatus::kBadDrives;
  }
  at += section_bytes(at);
  return TableStatus::kOk;
}

inline Table::Span Table::span(const Axis& axis, int32_t place_um) {
  constexpr uint32_t kOne = 1U << f::kFractionBits;
  // Unsigned, so that what lies below the lower edge is beyond the upper one too.
  uint32_t from_edge = static_cast<uint32_t>(place_um) + axis.half_um, flip = 0;
  if (from_edge > axis.last_um) from_edge = place_um < 0 ? 0 : axis.last_um;
  if (from_edge > axis.fold_um) {
    from_edge = axis.last_um - from_edge;
    flip = axis.flip;
  }
  const uint32_t at = (from_edge * axis.step) >> axis.shift;
  // Beyond the outermost centres all is flat: here by holding on to them, at the other end because
  // the last cell is its own neighbour.
  const uint32_t inner = at > kOne / 2 ? at - kOne / 2 : 0;
  const uint32_t low = inner >> f::kFractionBits;
  const bool is_last = low == axis.last;
  return {low * axis.to_next, is_last ? 0 : axis.to_next, inner & (kOne - 1), flip,
          is_last ? axis.beyond : 0};
}

void Table::drive_at(Place place, Drive& result) const {
  constexpr uint32_t kOne = 1U << f::kFractionBits;
  const int32_t x_um = place.x_um, y_um = place.y_um;
  const Span y = span(y_, y_um), x = span(x_, x_um);
  const uint8_t* const at0 = records_ + x.low + y.low;
  const uint8_t *const at1 = at0 + x.to_next, *const at2 = at0 + y.to_next;
  const uint8_t* const at3 = at1 + y.to_next;
  const uint32_t top = kOne * y.fraction, bottom = kOne * kOne - top;
  uint32_t w1 = (bottom * x.fraction) >> f::kFractionBits, w0 = bottom - w1;
  uint32_t w3 = (top * x.fraction) >> f::kFractionBits, w2 = top - w3;
  const uint32_t flips = x.flip | y.flip, images = x.image | y.image;
  const uint32_t label0 = *at0;
  uint32_t label1 = *at1, label2 = *at2, label3 = *at3;
  // An image across a cut belongs to no label.
  if ((images & 1U) != 0) {
    if ((crossings_[label1] & kCutX) != 0) label1 = kNoLabel;
    if ((crossings_[label3] & kCutX) != 0) label3 = kNoLabel;
  }
  if ((images & 2U) != 0) {
    if ((crossings_[label2] & kCutY) != 0) label2 = kNoLabel;
    if (label3 != kNoLabel && (crossings_[label3] & kCutY) != 0) label3 = kNoLabel;
  }
  uint32_t label = label0;
  if (label != label1 || label != label2 || label != label3) {
    // Only what carries the nearest corner's label takes part. Another gives its weight to the
    // corner next to it along x, or else along y, or else to the one opposite.
    const bool is_right = x.fraction >= kOne / 2;
    label = y.fraction < kOne / 2 ? (is_right ? label1 : label0) : (is_right ? label3 : label2);
    const bool is0 = label == label0, is1 = label == label1;
    const bool is2 = label == label2, is3 = label == label3;
    const uint32_t given0 = is0 ? 0 : w0, given1 = is1 ? 0 : w1;
    const uint32_t given2 = is2 ? 0 : w2, given3 = is3 ? 0 : w3;
    w0 -= given0;
    w1 -= given1;
    w2 -= given2;
    w3 -= given3;
    (is1 ? w1 : is2 ? w2 : w3) += given0;
    (is0 ? w0 : is3 ? w3 : w2) += given1;
    (is3 ? w3 : is0 ? w0 : w1) += given2;
    (is2 ? w2 : is1 ? w1 : w0) += given3;
  }
  if ((flips | images) != 0) {
    const uint32_t negations = negations_of(crossings_[label]);
    const uint32_t odd = negations & flips, odd_images = negations & images;
    // In both directions it is no longer odd.
    if (odd == 1 || odd == 2) {
      w0 = 0U - w0;
      w1 = 0U - w1;
      w2 = 0U - w2;
      w3 = 0U - w3;
    }
    if ((odd_images & 1U) != 0) {
      w1 = 0U - w1;
      w3 = 0U - w3;
    }
    if ((odd_images & 2U) != 0) {
      w2 = 0U - w2;
      w3 = 0U - w3;
    }
  }
  const Mix mix = {{at0, at1, at2, at3}, {w0, w1, w2, w3}, sources_[images][flips].data()};
  Gain* const to = result.data();
  if (bits_ == 12) {
    mix_gains<12>(mix, to);
  } else if (bits_ == 8) {
    mix_gains<8>(mix, to);
  } else {
    mix_gains<16>(mix, to);
  }
}

}  // namespace chladni
