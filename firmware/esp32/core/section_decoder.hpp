// Decodes a section's stream: labels first, then drives from coarse to fine (docs/table-format.md).
//
// A region is predicted as the mean of the neighbours that were decoded before and carry its label;
// the stream holds what is left, in Rice codes whose parameters carry over from region to region.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/table_format.hpp"
#include "core/stream_reader.hpp"
#include "core/synthesis.hpp"

namespace chladni {

// A label that no region has: what lies across a cut.
constexpr uint8_t kNoLabel = 0xFF;
static_assert(table_format::kMaxLabels <= kNoLabel, "labels are below");

// The drives of one section, decoded, row by row.
struct SectionDrives {
  // What becomes of a label across the mirrors. Bit f: by the flips f (bit 0 in x, bit 1 in y) it
  // is cut off from its image; its drives are negated.
  std::array<uint8_t, table_format::kMaxLabels> cuts;
  std::array<uint8_t, table_format::kMaxLabels> negations;
  std::array<uint8_t, table_format::kMaxNodes> labels;
  std::array<Gain, table_format::kMaxGains> gains;  // `actuators` of them per region
  // While decoding: the region decoded last, of every label; kNone before the first.
  std::array<uint16_t, table_format::kMaxLabels> latest;
};

struct SectionShape {
  uint32_t columns;  // stored ones
  uint32_t rows;
  uint32_t pitch;  // from one row to the next in memory
  uint32_t actuators;
  uint32_t labels;
  uint32_t start_shift;
};

// Status kOk and nothing left to read, or the drives are void.
StreamReader::Status decode_section(StreamReader& stream, const SectionShape& shape,
                                    SectionDrives& drives);

}  // namespace chladni
