// Any bytes as a table whose CRC is right: what the device takes in, it looks up without harm.
#include <memory>

#include "core/base/crc32.hpp"
#include "core/table/table.hpp"
#include "fuzz/memory_hal.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chladni;
  if (size < 8 || size > table_format::kLargestFile) return -1;
  fuzz::Board board;
  std::memcpy(board.tables.data(), data, size);
  // The header says how long it is; the CRC belongs there.
  uint32_t total = 0;
  std::memcpy(&total, board.tables.data() + table_format::kAtTotalBytes, 4);
  if (total >= 4 && total <= table_format::kLargestFile) {
    const uint32_t crc = crc32(board.tables.data(), total - 4);
    std::memcpy(board.tables.data() + total - 4, &crc, 4);
  }
  const Hal hal = fuzz::make_hal(board);
  const auto table = std::make_unique<Table>();
  const uint32_t channels =
      size > table_format::kAtActuators ? data[table_format::kAtActuators] : 5U;
  if (table->load(hal, channels) != TableStatus::kOk) return 0;
  Drive drive{};
  PlaceResponses responses{};
  const auto read_at = [&](Place place) {
    table->drive_at(place, drive);
    if (!table->responses_at(place, responses)) return;
    for (uint32_t k = 0; k < channels; ++k) table->coupling(k, channels - 1U - k);
  };
  for (int32_t x = -300000; x <= 300000; x += 37111) {
    for (int32_t y = -300000; y <= 300000; y += 41177) read_at({x, y});
  }
  table->select(160000);
  read_at({0, 0});
  return 0;
}
