// The drive table: read from flash once, checked whole, kept in RAM, looked up by place.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/table_format.hpp"
#include "core/hal.hpp"
#include "core/section_decoder.hpp"
#include "core/synthesis.hpp"

namespace chladni {

enum class TableStatus : uint8_t {
  kOk,
  kNone,            // the partition is blank
  kReadFailed,      // flash could not be read
  kBadMagic,        // something else than a table
  kBadVersion,      // a format this firmware does not know
  kBadSize,         // sizes that contradict each other
  kBadCrc,          // damaged bytes
  kBadField,        // a header field out of its range
  kBadDrives,       // a stream that is no drives
  kTooLarge,        // more drives than fit into RAM
  kWrongActuators,  // made for another number of channels
  kNoSection,       // no drives for the frequency asked for
};

const char* to_text(TableStatus status);

class Table {
 public:
  // Read and check the table at the start of the partition, all its sections, and keep the drives
  // of the first. Unless kOk comes back there is no table.
  TableStatus load(const Hal& hal, uint32_t channels);
  // Keep the drives of another frequency instead. Unless kOk or kNoSection comes back, there is no
  // table any more.
  TableStatus select(const Hal& hal, uint32_t frequency_mhz);

  bool is_loaded() const { return is_loaded_; }
  // Of the drives in use.
  uint32_t frequency_mhz() const { return frequency_mhz_; }
  uint32_t ramp_us() const { return ramp_us_; }
  uint32_t touch_timeout_us() const { return touch_timeout_us_; }
  uint32_t max_on_us() const { return max_on_us_; }
  uint32_t regions() const { return x_.cells * y_.cells; }

  // The region of a place; places off the board belong to the nearest region.
  uint32_t region_at(Place place) const;
  // The drive of a region below `regions()`; channels beyond the table's are silent.
  Drive drive(uint32_t region) const;
  // The drive of a place, interpolated between the regions around it that lie on one branch; places
  // off the board get that of the nearest place on it.
  Drive drive_at(Place place) const;

 private:
  // One direction across the board.
  struct Axis {
    uint32_t cells = 0;
    int32_t span_um = 0;
    uint32_t step = 0;  // (offset * step) >> shift is in 1/256 cells
    uint32_t shift = 0;
    uint32_t stored = 0;
    bool is_mirrored = false;  // only the cells at small x (y) are stored
  };

  // Where a place lies between two neighbouring cells' centres.
  struct Span {
    uint32_t low;
    uint32_t high;
    uint32_t fraction;  // of the way to `high`, in 1/256
  };

  struct Cell {
    uint32_t stored;
    uint32_t flips;  // bit 0: a mirror image in x; bit 1: in y
  };

  TableStatus check(const Hal& hal, uint32_t channels);
  TableStatus check_crc(const Hal& hal, uint32_t total_bytes) const;
  bool take_header(const uint8_t* header);
  TableStatus decode(const Hal& hal, uint32_t section);
  static uint32_t position(const Axis& axis, int32_t place_um);
  static Span span(const Axis& axis, int32_t place_um);
  Cell cell(uint32_t column, uint32_t row) const;
  bool is_negated(const Cell& cell) const;
  void add(const Cell& cell, int32_t weight,
           std::array<std::array<int32_t, 2>, kMaxChannels>& sum) const;

  bool is_loaded_ = false;
  uint32_t actuators_ = 0;
  uint32_t total_bytes_ = 0;
  uint32_t header_bytes_ = 0;
  uint32_t section_bytes_ = 0;
  uint32_t sections_ = 0;
  Axis x_;
  Axis y_;
  uint32_t frequency_mhz_ = 0;
  uint32_t ramp_us_ = 0;
  uint32_t touch_timeout_us_ = 0;
  uint32_t max_on_us_ = 0;
  // The stored channel that each channel plays, by the flips of a cell.
  std::array<std::array<uint8_t, table_format::kMaxActuators>, 4> orders_{};
  SectionDrives drives_{};
};

}  // namespace chladni
