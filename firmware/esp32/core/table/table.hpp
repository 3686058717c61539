// The drive table: checked whole once, then read where it lies in flash. No table costs RAM.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"
#include "core/generated/table_format.hpp"
#include "core/hal.hpp"
#include "core/synthesis/drive.hpp"
#include "core/table/mirrors.hpp"

namespace chladni {

class Table {
 public:
  // Check the table that begins at `base` in the partition, all its sections, and use the drives of
  // the first. Unless kOk comes back there is no table.
  TableStatus load(const Hal& hal, uint32_t channels, uint32_t base = 0);
  // What `load` would say of a table for so many channels that begins with these header bytes, as
  // far as they tell.
  static TableStatus check_head(const uint8_t* header, uint32_t total_bytes, uint32_t channels);
  // Whether the bytes in use are still what was loaded.
  bool is_intact() const;
  // Use the drives of another frequency instead; kNoSection, and all as before, if there are none.
  TableStatus select(uint32_t frequency_millihertz);

  bool is_loaded() const { return is_loaded_; }
  // Of the drives in use.
  uint32_t frequency_millihertz() const { return frequency_millihertz_; }
  uint32_t ramp_us() const { return ramp_us_; }
  uint32_t touch_timeout_us() const { return touch_timeout_us_; }
  uint32_t max_on_us() const { return max_on_us_; }
  uint32_t total_bytes() const { return total_bytes_; }
  uint32_t crc() const { return crc_; }
  const uint8_t* bytes() const { return bytes_; }
  // Fingerprint and name of its board, as they stand in the header.
  const uint8_t* identity() const { return bytes_ + table_format::kAtBoardFingerprint; }

  // The drive of a place, interpolated between the regions around it that lie on one branch; places
  // off the board get that of the nearest place on it. Only the table's channels are written.
  void drive_at(Place place, Drive& result) const;
  // The nearest place on the board.
  Place on_board(Place place) const;

 private:
  // One direction across the board.
  struct Axis {
    uint32_t half_um = 0;  // from the lower edge to the centre
    uint32_t last_um = 0;  // offset of the last place on the board
    uint32_t fold_um = 0;  // offsets beyond are mirrored to this side
    uint32_t flip = 0;     // bit of this direction in the flips of a place
    uint32_t step = 0;     // (offset * step) >> shift is in 1/256 cells
    uint32_t shift = 0;
    uint32_t last = 0;     // stored cell; where mirrored, only the cells at small x (y) are
    uint32_t beyond = 0;   // flip of the cell behind the last one: its image if it meets that
    uint32_t to_next = 0;  // bytes from a cell's record to the next one's
  };

  // Where a place lies between two neighbouring cells' centres.
  struct Span {
    uint32_t low;       // bytes of the records below, in this direction
    uint32_t to_next;   // bytes from there to the next cell, 0 if there is none
    uint32_t fraction;  // of the way to the next one, in 1/256
    uint32_t flip;      // the direction's bit if the place's mirror image is meant
    uint32_t image;     // the same if the next cell is the image of this one
  };

  struct SectionView {
    uint32_t frequency_millihertz;
    const uint8_t* crossings;
    const uint8_t* records;
  };

  static TableStatus check_kind(const uint8_t* header);
  TableStatus check(const Hal& hal, uint32_t channels, uint32_t base);
  bool take_header(const uint8_t* header);
  static bool take_axis(const uint8_t* header, uint32_t at_cells, uint32_t at_span, uint32_t flip,
                        Axis& axis);
  TableStatus check_sections() const;
  TableStatus check_section(uint32_t& at) const;
  SectionView view(uint32_t at) const;
  uint32_t section_bytes(uint32_t at) const;
  void use(uint32_t at);
  static Span span(const Axis& axis, int32_t place_um);

  bool is_loaded_ = false;
  const uint8_t* bytes_ = nullptr;  // the whole table, where it lies
  uint32_t total_bytes_ = 0;
  uint32_t crc_ = 0;
  uint32_t actuators_ = 0;
  uint32_t bits_ = 0;
  uint32_t sections_ = 0;
  uint32_t cells_ = 0;  // records of a section
  uint32_t record_bytes_ = 0;
  uint32_t ramp_us_ = 0;
  uint32_t touch_timeout_us_ = 0;
  uint32_t max_on_us_ = 0;
  Axis x_;
  Axis y_;
  // Of the drives in use.
  uint32_t frequency_millihertz_ = 0;
  const uint8_t* crossings_ = nullptr;
  const uint8_t* records_ = nullptr;
  SourcesByFlips sources_{};
};

}  // namespace chladni
