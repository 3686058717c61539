// The drive table: read from flash once, checked whole, kept in RAM, looked up by place.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"
#include "core/generated/table_format.hpp"
#include "core/hal.hpp"
#include "core/section_decoder.hpp"
#include "core/synthesis.hpp"

namespace chladni {

class Table {
 public:
  // Read and check the table that begins at `base` in the partition, all its sections, and keep the
  // drives of the first. Unless kOk comes back there is no table.
  TableStatus load(const Hal& hal, uint32_t channels, uint32_t base = 0);
  // Keep the drives of another frequency instead. Unless kOk or kNoSection comes back, there is no
  // table any more.
  TableStatus select(const Hal& hal, uint32_t frequency_mhz);

  bool is_loaded() const { return is_loaded_; }
  // Of the drives in use.
  uint32_t frequency_mhz() const { return frequency_mhz_; }
  uint32_t ramp_us() const { return ramp_us_; }
  uint32_t touch_timeout_us() const { return touch_timeout_us_; }
  uint32_t max_on_us() const { return max_on_us_; }
  uint32_t total_bytes() const { return total_bytes_; }
  uint32_t crc() const { return crc_; }
  // Fingerprint and name of its board, as they stand in the header.
  static constexpr uint32_t kIdentityBytes = 8 + table_format::kBoardNameBytes;
  const std::array<uint8_t, kIdentityBytes>& identity() const { return identity_; }
  uint32_t regions() const { return x_.cells * y_.cells; }

  // The region of a place; places off the board belong to the nearest region.
  uint32_t region_at(Place place) const;
  // The drive of a region below `regions()`; only the table's channels are written.
  void drive(uint32_t region, Drive& result) const;
  // The drive of a place, interpolated between the regions around it that lie on one branch; places
  // off the board get that of the nearest place on it.
  void drive_at(Place place, Drive& result) const;

 private:
  // One direction across the board.
  struct Axis {
    uint32_t cells = 0;
    uint32_t half_um = 0;  // from the lower edge to the centre
    uint32_t last_um = 0;  // offset of the last place on the board
    uint32_t fold_um = 0;  // offsets beyond are mirrored to this side
    uint32_t flip = 0;     // bit of this direction in the flips of a place
    uint32_t step = 0;     // (offset * step) >> shift is in 1/256 cells
    uint32_t shift = 0;
    uint32_t stored = 0;  // where mirrored, only the cells at small x (y) are
    uint32_t nodes = 0;   // those in memory, one more
    bool meets = false;   // a cell touches its mirror image
  };

  // Where a place lies between two neighbouring cells' centres.
  struct Span {
    uint32_t low;
    int32_t fraction;  // of the way to the next one, in 1/256
    uint32_t flip;     // the direction's bit if the place's mirror image is meant
  };

  TableStatus check(const Hal& hal, uint32_t channels);
  bool take_header(const uint8_t* header);
  TableStatus decode(const Hal& hal, uint32_t section);
  static uint32_t position(const Axis& axis, uint32_t offset_um);
  static uint32_t offset(const Axis& axis, int32_t place_um);
  static Span span(const Axis& axis, int32_t place_um);
  void add_images();
  void add_image(uint32_t at, uint32_t image, uint32_t flips);
  void copy_image(uint32_t at, uint32_t flips, Gain* to) const;
  bool is_negated(uint8_t label, uint32_t flips) const;

  bool is_loaded_ = false;
  uint32_t actuators_ = 0;
  uint32_t base_ = 0;
  uint32_t crc_ = 0;
  std::array<uint8_t, kIdentityBytes> identity_{};
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
  // The stored channel that each channel plays, by the flips of a cell; and the other way round.
  std::array<std::array<uint8_t, table_format::kMaxActuators>, 4> orders_{};
  std::array<std::array<uint8_t, 2 * table_format::kMaxActuators>, 4> players_{};
  SectionDrives drives_{};  // row by row over the nodes
};

}  // namespace chladni
