// The drive table: checked whole once, then read where it lies in flash. No table costs RAM.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"
#include "core/generated/table_format.hpp"
#include "core/hal.hpp"
#include "core/synthesis/drive.hpp"
#include "core/table/mirrors.hpp"
#include "core/table/responses.hpp"

namespace chladni {

class Table {
 public:
  // Check the table that begins at `base` in the partition, all its sections, and use those of the
  // first one's frequency. Unless kOk comes back there is no table.
  TableStatus load(const Hal& hal, uint32_t channels, uint32_t base = 0);
  // What `load` would say of a table for so many channels that begins with these header bytes, as
  // far as they tell.
  static TableStatus check_head(const uint8_t* header, uint32_t total_bytes, uint32_t channels);
  // Whether the bytes in use are still what was loaded.
  bool is_intact() const;
  // Use the drives and responses of another frequency instead; kNoSection, and all as before, if
  // there are neither.
  TableStatus select(uint32_t frequency_millihertz);

  bool is_loaded() const { return is_loaded_; }
  // Whether there are such of the frequency in use; of a loaded table one of them at least.
  bool has_drives() const { return records_ != nullptr; }
  bool has_responses() const { return responses_ != nullptr; }
  // Of what is in use.
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
  // off the board get that of the nearest place on it. Only the table's channels are written;
  // without drives to silence.
  void drive_at(Place place, Drive& result) const;
  // What each of the table's channels does at a place, and a fingertip's own compliance there,
  // interpolated as drives are. False, and nothing written, without responses.
  bool responses_at(Place place, PlaceResponses& result) const;
  // How one finger's push moves another, of two channels, N/m: symmetric. Needs responses.
  ComplexFloat coupling(uint32_t one, uint32_t other) const;
  // What presses, feels and pushes. Needs responses.
  ReckonedFinger finger() const;
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
    uint32_t to_next = 0;  // bytes from a drive's record to the next cell's
    uint32_t responses_to_next = 0;  // the same of responses
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
    uint32_t full_scale;
    bool are_responses;
    const uint8_t* head;  // crossings of drives; own scale and coupling of responses
    const uint8_t* records;
  };

  // Four corners around a place, before any label is looked at.
  struct Corners;

  static TableStatus check_kind(const uint8_t* header);
  TableStatus check(const Hal& hal, uint32_t channels, uint32_t base);
  bool take_header(const uint8_t* header);
  static bool take_axis(const uint8_t* header, uint32_t at_cells, uint32_t at_span, uint32_t flip,
                        Axis& axis);
  TableStatus check_sections() const;
  TableStatus check_section(uint32_t& at, bool& after_responses) const;
  TableStatus check_drives(const SectionView& section, uint32_t labels) const;
  TableStatus check_responses(const SectionView& section) const;
  SectionView view(uint32_t at) const;
  uint32_t section_bytes(uint32_t at) const;
  uint32_t coupling_bytes() const;
  static Span span(const Axis& axis, uint32_t to_next, int32_t place_um);
  // What the integers of responses come to at a place.
  void mix_responses(Place place, Drive& coils, Gain& own) const;
  static Corners corners(const uint8_t* records, const Span& x, const Span& y);

  bool is_loaded_ = false;
  const uint8_t* bytes_ = nullptr;  // the whole table, where it lies
  uint32_t total_bytes_ = 0;
  uint32_t crc_ = 0;
  uint32_t actuators_ = 0;
  uint32_t bits_ = 0;
  uint32_t sections_ = 0;
  uint32_t minor_ = 0;           // version
  uint32_t cells_ = 0;           // records of a section
  uint32_t record_bytes_ = 0;    // of drives
  uint32_t response_bytes_ = 0;  // the same of responses
  uint32_t ramp_us_ = 0;
  uint32_t touch_timeout_us_ = 0;
  uint32_t max_on_us_ = 0;
  Axis x_;
  Axis y_;
  // Of the drives and responses in use.
  uint32_t frequency_millihertz_ = 0;
  const uint8_t* crossings_ = nullptr;
  const uint8_t* records_ = nullptr;
  const uint8_t* responses_head_ = nullptr;  // own scale and coupling
  const uint8_t* responses_ = nullptr;       // records
  uint32_t full_scale_pm_ = 0;               // of responses, pm/N
  SourcesByFlips sources_{};
};

}  // namespace chladni
