#include "core/table.hpp"

#include "core/crc32.hpp"
#include "core/generated/table_format.hpp"

namespace chladni {

namespace {

namespace f = table_format;

constexpr uint32_t kChunkBytes = 256;
static_assert(kChunkBytes % 4 == 0, "a gain pair must not straddle two chunks");
static_assert(f::kMaxActuators == kMaxChannels, "tables and synthesis disagree");

uint32_t read_u16(const uint8_t* bytes) {
  return static_cast<uint32_t>(bytes[0]) | (static_cast<uint32_t>(bytes[1]) << 8);
}

uint32_t read_u32(const uint8_t* bytes) { return read_u16(bytes) | (read_u16(bytes + 2) << 16); }

int16_t read_i16(const uint8_t* bytes) {
  const auto value = static_cast<int32_t>(read_u16(bytes));
  return static_cast<int16_t>(value >= 0x8000 ? value - 0x10000 : value);
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
  if (h[f::kAtVersionMajor] != f::kVersionMajor || h[f::kAtVersionMinor] > f::kVersionMinor) {
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
  if (read_u16(h + f::kAtHeaderBytes) != f::kHeaderBytes) return TableStatus::kBadSize;
  const bool fields_fit =
      in_range(actuators_, 1, f::kMaxActuators) && h[f::kAtEncoding] == f::kEncodingIq16 &&
      in_range(columns_, 1, f::kMaxCellsPerSide) && in_range(rows_, 1, f::kMaxCellsPerSide) &&
      in_range(width_um_, 1, f::kMaxSpanUm) && in_range(length_um_, 1, f::kMaxSpanUm) &&
      columns_ * rows_ <= f::kMaxRegions &&
      in_range(frequency_mhz_, f::kMinFrequencyMhz, f::kMaxFrequencyMhz) &&
      in_range(ramp_us_, f::kMinRampUs, f::kMaxRampUs) &&
      in_range(touch_timeout_us_, f::kMinTouchTimeoutUs, f::kMaxTouchTimeoutUs) &&
      in_range(max_on_us_, f::kMinOnUs, f::kMaxOnUs) && read_u16(h + f::kAtReserved) == 0;
  if (!fields_fit) return TableStatus::kBadField;
  if (actuators_ != channels) return TableStatus::kWrongActuators;
  const uint32_t gains = columns_ * rows_ * actuators_;
  *payload_bytes = gains * 4U;
  if (read_u32(h + f::kAtTotalBytes) != f::kHeaderBytes + *payload_bytes + f::kCrcBytes) {
    return TableStatus::kBadSize;
  }
  if (gains > f::kMaxGains) return TableStatus::kTooLarge;
  running_crc_ = crc32_feed(kCrc32Start, h, f::kHeaderBytes);
  return TableStatus::kOk;
}

TableStatus Table::load(const Hal& hal, uint32_t channels) {
  is_loaded_ = false;
  uint32_t payload_bytes = 0;
  const TableStatus status = read_header(hal, channels, &payload_bytes);
  if (status != TableStatus::kOk) return status;
  uint32_t gain = 0;
  std::array<uint8_t, kChunkBytes> chunk{};
  for (uint32_t done = 0; done < payload_bytes;) {
    const uint32_t left = payload_bytes - done;
    const uint32_t count = left < kChunkBytes ? left : kChunkBytes;
    if (!hal.read_table(hal.context, f::kHeaderBytes + done, chunk.data(), count)) {
      return TableStatus::kReadFailed;
    }
    running_crc_ = crc32_feed(running_crc_, chunk.data(), count);
    for (uint32_t at = 0; at < count; at += 4) {
      gains_[gain++] = {read_i16(&chunk[at]), read_i16(&chunk[at + 2])};
    }
    done += count;
  }
  std::array<uint8_t, f::kCrcBytes> stored{};
  if (!hal.read_table(hal.context, f::kHeaderBytes + payload_bytes, stored.data(), f::kCrcBytes)) {
    return TableStatus::kReadFailed;
  }
  if (read_u32(stored.data()) != (running_crc_ ^ 0xFFFFFFFFU)) return TableStatus::kBadCrc;
  is_loaded_ = true;
  return TableStatus::kOk;
}

uint32_t Table::region_at(Place place) const {
  return cell(place.y_um, length_um_, rows_) * columns_ + cell(place.x_um, width_um_, columns_);
}

Drive Table::drive(uint32_t region) const {
  Drive result{};
  for (uint32_t k = 0; k < actuators_; ++k) result[k] = gains_[region * actuators_ + k];
  return result;
}

}  // namespace chladni
