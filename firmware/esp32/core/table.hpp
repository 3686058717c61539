// The drive table: read from flash once, checked whole, kept in RAM, looked up by place.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/table_format.hpp"
#include "core/hal.hpp"
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
  kTooLarge,        // more drives than fit into RAM
  kWrongActuators,  // made for another number of channels
};

const char* to_text(TableStatus status);

class Table {
 public:
  // Read and check the table at the start of the partition. Unless kOk comes back there is no
  // table.
  TableStatus load(const Hal& hal, uint32_t channels);

  bool is_loaded() const { return is_loaded_; }
  uint32_t frequency_mhz() const { return frequency_mhz_; }
  uint32_t ramp_us() const { return ramp_us_; }
  uint32_t touch_timeout_us() const { return touch_timeout_us_; }
  uint32_t max_on_us() const { return max_on_us_; }
  uint32_t regions() const { return columns_ * rows_; }

  // The region of a place; places off the board belong to the nearest region.
  uint32_t region_at(Place place) const;
  // The drive of a region below `regions()`; channels beyond the table's are silent.
  Drive drive(uint32_t region) const;

 private:
  TableStatus read_header(const Hal& hal, uint32_t channels, uint32_t* payload_bytes);

  // Width of a code, and what the largest one stands for.
  struct CodeField {
    uint32_t bits = 0;
    uint32_t scale = 0;
  };

  bool is_loaded_ = false;
  uint32_t actuators_ = 0;
  uint32_t columns_ = 0;
  uint32_t rows_ = 0;
  uint32_t width_um_ = 0;
  uint32_t length_um_ = 0;
  uint32_t frequency_mhz_ = 0;
  uint32_t ramp_us_ = 0;
  uint32_t touch_timeout_us_ = 0;
  uint32_t max_on_us_ = 0;
  uint32_t running_crc_ = 0;
  CodeField in_phase_;
  CodeField quadrature_;
  // Mirrors: only the half at small x (y) is stored, and which channel stands in for which.
  bool is_mirrored_x_ = false;
  bool is_mirrored_y_ = false;
  std::array<uint8_t, table_format::kMaxActuators> order_x_{};
  std::array<uint8_t, table_format::kMaxActuators> order_y_{};
  uint32_t stored_columns_ = 0;
  uint32_t stored_gains_ = 0;
  std::array<Gain, table_format::kMaxGains> gains_{};
};

}  // namespace chladni
