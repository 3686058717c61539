#include "core/table.hpp"

#include "core/crc32.hpp"
#include "core/generated/table_format.hpp"

namespace chladni {

namespace {

namespace f = table_format;

constexpr uint32_t kChunkBytes = 256;
static_assert(f::kMaxActuators == kMaxChannels, "tables and synthesis disagree");

uint32_t read_u16(const uint8_t* bytes) {
  return static_cast<uint32_t>(bytes[0]) | (static_cast<uint32_t>(bytes[1]) << 8);
}

uint32_t read_u32(const uint8_t* bytes) { return read_u16(bytes) | (read_u16(bytes + 2) << 16); }

// Codes of a few bits each, the least significant bit first, from bytes that come in chunks.
class BitReader {
 public:
  void feed(uint8_t byte) {
    bits_ |= static_cast<uint32_t>(byte) << count_;
    count_ += 8;
  }
  bool has(uint32_t width) const { return count_ >= width; }
  bool is_zero() const { return bits_ == 0; }
  // A two's complement code of `width` bits; there must be that many.
  int32_t take(uint32_t width) {
    const uint32_t sign = 1U << (width - 1);
    const uint32_t code = bits_ & (2 * sign - 1);
    bits_ >>= width;
    count_ -= width;
    return static_cast<int32_t>(code) - static_cast<int32_t>(code & sign) * 2;
  }

 private:
  uint32_t bits_ = 0;  // at most 15 left over, and the byte that comes
  uint32_t count_ = 0;
};

int32_t largest_code(uint32_t width) { return static_cast<int32_t>((1U << (width - 1)) - 1U); }

// code * scale / largest, rounded to a whole number, halves away from zero.
int16_t value_of(int32_t code, int32_t largest, int32_t scale) {
  const int32_t size = ((code < 0 ? -code : code) * scale + largest / 2) / largest;
  return static_cast<int16_t>(code < 0 ? -size : size);
}

// Nibble k of `nibbles` is the actuator that stands in for k. False unless that is an order which
// undoes itself.
bool read_order(uint32_t nibbles, uint32_t actuators,
                std::array<uint8_t, f::kMaxActuators>& order) {
  if (actuators < 8 && (nibbles >> (4 * actuators)) != 0) return false;
  for (uint32_t k = 0; k < actuators; ++k) {
    order[k] = static_cast<uint8_t>((nibbles >> (4 * k)) & 15U);
    if (order[k] >= actuators) return false;
  }
  for (uint32_t k = 0; k < actuators; ++k) {
    if (order[order[k]] != k) return false;
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

uint32_t cell(int32_t place_um, uint32_t span_um, uint32_t cells) {
  // Twice the offset from the lower edge, so that an odd span needs no half micrometre. Places
  // are clamped first, so nothing below can leave 32 bits (span 500,000, cells 2,048).
  const auto span = static_cast<int32_t>(span_um);
  const int32_t near = place_um < -span ? -span : (place_um > span ? span : place_um);
  int32_t doubled = 2 * near + span;
  if (doubled < 0) doubled = 0;
  if (doubled > 2 * span - 1) doubled = 2 * span - 1;
  return (static_cast<uint32_t>(doubled) >> 1) * cells / span_um;
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
    case TableStatus::kTooLarge: return "table too large";
    case TableStatus::kWrongActuators: return "table is for another number of actuators";
  }
  return "unknown";
}

TableStatus Table::read_header(const Hal& hal, uint32_t channels, uint32_t* payload_bytes) {
  std::array<uint8_t, f::kHeaderBytes> header{};
  if (!hal.read_table(hal.context, 0, header.data(), f::kHeaderBytes)) {
    return TableStatus::kReadFailed;
  }
  const uint8_t* const h = header.data();
  if (is_blank(header)) return TableStatus::kNone;
  if (read_u32(h + f::kAtMagic) != f::kMagic) return TableStatus::kBadMagic;
  if (h[f::kAtVersionMajor] != f::kVersionMajor || h[f::kAtVersionMinor] != f::kVersionMinor) {
    return TableStatus::kBadVersion;
  }
  actuators_ = h[f::kAtActuators];
  columns_ = read_u16(h + f::kAtColumns);
  rows_ = read_u16(h + f::kAtRows);
  width_um_ = read_u32(h + f::kAtWidthUm);
  length_um_ = read_u32(h + f::kAtLengthUm);
  frequency_mhz_ = read_u32(h + f::kAtFrequencyMhz);
  ramp_us_ = read_u32(h + f::kAtRampUs);
  touch_timeout_us_ = read_u32(h + f::kAtTouchTimeoutUs);
  max_on_us_ = read_u32(h + f::kAtMaxOnUs);
  in_phase_ = {h[f::kAtInPhaseBits], read_u16(h + f::kAtInPhaseScale)};
  quadrature_ = {h[f::kAtQuadratureBits], read_u16(h + f::kAtQuadratureScale)};
  if (read_u16(h + f::kAtHeaderBytes) != f::kHeaderBytes) return TableStatus::kBadSize;
  const bool fields_fit =
      in_range(actuators_, 1, f::kMaxActuators) && h[f::kAtMirrors] <= 3 &&
      in_range(in_phase_.bits, f::kMinBits, f::kMaxBits) &&
      in_range(quadrature_.bits, f::kMinBits, f::kMaxBits) &&
      in_range(in_phase_.scale, 1, f::kFullScale) &&
      in_range(quadrature_.scale, 1, f::kFullScale) && in_range(columns_, 1, f::kMaxCellsPerSide) &&
      in_range(rows_, 1, f::kMaxCellsPerSide) && in_range(width_um_, 1, f::kMaxSpanUm) &&
      in_range(length_um_, 1, f::kMaxSpanUm) && columns_ * rows_ <= f::kMaxRegions &&
      in_range(frequency_mhz_, f::kMinFrequencyMhz, f::kMaxFrequencyMhz) &&
      in_range(ramp_us_, f::kMinRampUs, f::kMaxRampUs) &&
      in_range(touch_timeout_us_, f::kMinTouchTimeoutUs, f::kMaxTouchTimeoutUs) &&
      in_range(max_on_us_, f::kMinOnUs, f::kMaxOnUs);
  if (!fields_fit) return TableStatus::kBadField;
  is_mirrored_x_ = (h[f::kAtMirrors] & 1U) != 0;
  is_mirrored_y_ = (h[f::kAtMirrors] & 2U) != 0;
  const uint32_t order_x = read_u32(h + f::kAtMirrorX), order_y = read_u32(h + f::kAtMirrorY);
  const bool orders_fit =
      (is_mirrored_x_ ? read_order(order_x, actuators_, order_x_) : order_x == 0) &&
      (is_mirrored_y_ ? read_order(order_y, actuators_, order_y_) : order_y == 0);
  if (!orders_fit) return TableStatus::kBadField;
  if (actuators_ != channels) return TableStatus::kWrongActuators;
  stored_columns_ = is_mirrored_x_ ? (columns_ + 1) / 2 : columns_;
  const uint32_t stored_rows = is_mirrored_y_ ? (rows_ + 1) / 2 : rows_;
  const uint32_t gains = stored_columns_ * stored_rows * actuators_;
  *payload_bytes = (gains * (in_phase_.bits + quadrature_.bits) + 7U) / 8U;
  if (read_u32(h + f::kAtTotalBytes) != f::kHeaderBytes + *payload_bytes + f::kCrcBytes) {
    return TableStatus::kBadSize;
  }
  if (gains > f::kMaxGains) return TableStatus::kTooLarge;
  stored_gains_ = gains;
  running_crc_ = crc32_feed(kCrc32Start, h, f::kHeaderBytes);
  return TableStatus::kOk;
}

TableStatus Table::load(const Hal& hal, uint32_t channels) {
  is_loaded_ = false;
  uint32_t payload_bytes = 0;
  const TableStatus status = read_header(hal, channels, &payload_bytes);
  if (status != TableStatus::kOk) return status;
  BitReader reader;
  uint32_t gain = 0;
  bool is_second = false;  // the in-phase part is in, the quadrature part is next
  int16_t in_phase = 0;
  bool codes_fit = true;
  std::array<uint8_t, kChunkBytes> chunk{};
  for (uint32_t done = 0; done < payload_bytes;) {
    const uint32_t left = payload_bytes - done;
    const uint32_t count = left < kChunkBytes ? left : kChunkBytes;
    if (!hal.read_table(hal.context, f::kHeaderBytes + done, chunk.data(), count)) {
      return TableStatus::kReadFailed;
    }
    running_crc_ = crc32_feed(running_crc_, chunk.data(), count);
    for (uint32_t at = 0; at < count; ++at) {
      reader.feed(chunk[at]);
      while (gain < stored_gains_) {
        const CodeField& field = is_second ? quadrature_ : in_phase_;
        if (!reader.has(field.bits)) break;
        const int32_t largest = largest_code(field.bits);
        const int32_t code = reader.take(field.bits);
        codes_fit = codes_fit && code >= -largest;
        const int16_t value = value_of(code, largest, static_cast<int32_t>(field.scale));
        if (is_second) gains_[gain++] = {in_phase, value};
        in_phase = value;
        is_second = !is_second;
      }
    }
    done += count;
  }
  std::array<uint8_t, f::kCrcBytes> stored{};
  if (!hal.read_table(hal.context, f::kHeaderBytes + payload_bytes, stored.data(), f::kCrcBytes)) {
    return TableStatus::kReadFailed;
  }
  if (read_u32(stored.data()) != (running_crc_ ^ 0xFFFFFFFFU)) return TableStatus::kBadCrc;
  if (!codes_fit || !reader.is_zero()) return TableStatus::kBadField;
  is_loaded_ = true;
  return TableStatus::kOk;
}

uint32_t Table::region_at(Place place) const {
  return cell(place.y_um, length_um_, rows_) * columns_ + cell(place.x_um, width_um_, columns_);
}

Drive Table::drive(uint32_t region) const {
  uint32_t column = region % columns_, row = region / columns_;
  const bool flip_x = is_mirrored_x_ && 2 * column >= columns_;
  const bool flip_y = is_mirrored_y_ && 2 * row >= rows_;
  if (flip_x) column = columns_ - 1 - column;
  if (flip_y) row = rows_ - 1 - row;
  const uint32_t first = (row * stored_columns_ + column) * actuators_;
  Drive result{};
  for (uint32_t k = 0; k < actuators_; ++k) {
    uint32_t from = flip_y ? order_y_[k] : k;
    if (flip_x) from = order_x_[from];
    result[k] = gains_[first + from];
  }
  return result;
}

}  // namespace chladni
