// A board in memory for fuzzers: flash that does as it is told, a panel that says anything.
#pragma once

#include <array>
#include <cstring>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"
#include "core/generated/network_format.hpp"
#include "core/generated/store_format.hpp"
#include "core/hal.hpp"
#include "core/storage/config.hpp"
#include "core/storage/retained.hpp"

namespace chladni::fuzz {

struct Board {
  std::vector<uint8_t> tables = std::vector<uint8_t>(store_format::kTablePartitionBytes, 0xFF);
  std::vector<uint8_t> config = std::vector<uint8_t>(2 * kSectorBytes, 0xFF);
  std::vector<uint8_t> network = std::vector<uint8_t>(kSectorBytes, 0xFF);
  std::vector<uint8_t> effects = std::vector<uint8_t>(store_format::kBankPartitionBytes, 0xFF);
  std::array<uint8_t, kRetainedBytes> retained{};
  uint32_t now_us = 0;
  // What the panel's bus reads, over and over.
  const uint8_t* bus = nullptr;
  size_t bus_size = 0, bus_at = 0;

  uint8_t next() { return bus_size == 0 ? uint8_t{0} : bus[bus_at++ % bus_size]; }
};

// What a device needs to be on a network.
inline std::array<uint8_t, network_format::kRecordBytes> network_record() {
  namespace f = network_format;
  std::array<uint8_t, f::kRecordBytes> record{};
  put_word(&record[f::kRecordAtMagic], f::kRecordMagic, 4);
  put_word(&record[f::kRecordAtVersion], f::kVersion, 2);
  put_word(&record[f::kRecordAtPort], f::kLowestPort, 2);
  record[f::kRecordAtKey] = 1;
  const uint32_t covered = f::kRecordBytes - 4U;
  put_word(&record[covered], crc32(record.data(), covered), 4);
  return record;
}

inline Board& board_of(void* context) { return *static_cast<Board*>(context); }

inline uint8_t* area_of(Board& board, FlashArea area, uint32_t& size) {
  std::vector<uint8_t>* own = &board.tables;
  if (area == FlashArea::kConfig) own = &board.config;
  if (area == FlashArea::kNetwork) own = &board.network;
  if (area == FlashArea::kEffects) own = &board.effects;
  static std::vector<uint8_t> none;
  if (area == FlashArea::kBoots) own = &none;
  size = static_cast<uint32_t>(own->size());
  return own->data();
}

inline void add_flash(Hal& hal) {
  hal.read_flash = [](void* context, FlashArea area, uint32_t offset, uint8_t* bytes,
                      uint32_t count) {
    uint32_t size = 0;
    const uint8_t* const own = area_of(board_of(context), area, size);
    if (offset > size || count > size - offset) return false;
    std::memcpy(bytes, own + offset, count);
    return true;
  };
  hal.map_flash = [](void* context, FlashArea area, uint32_t offset,
                     uint32_t count) -> const uint8_t* {
    uint32_t size = 0;
    const uint8_t* const own = area_of(board_of(context), area, size);
    return offset > size || count > size - offset ? nullptr : own + offset;
  };
  hal.erase_sector = [](void* context, FlashArea area, uint32_t offset) {
    uint32_t size = 0;
    uint8_t* const own = area_of(board_of(context), area, size);
    if (offset % kSectorBytes != 0 || offset >= size) __builtin_trap();
    std::memset(own + offset, 0xFF, kSectorBytes);
    return true;
  };
  hal.program_flash = [](void* context, FlashArea area, uint32_t offset, const uint8_t* bytes,
                         uint32_t count) {
    uint32_t size = 0;
    uint8_t* const own = area_of(board_of(context), area, size);
    if (offset > size || count > size - offset) __builtin_trap();
    for (uint32_t k = 0; k < count; ++k) own[offset + k] &= bytes[k];
    return true;
  };
}

inline Hal make_hal(Board& board) {
  Hal hal{};
  hal.context = &board;
  hal.now_us = [](void* context) { return board_of(context).now_us; };
  hal.set_duties = [](void*, int32_t*, uint32_t) {};
  hal.stack_free = [](void*) -> uint32_t { return 0; };
  hal.cut_outputs = [](void*) {};
  hal.retained = [](void* context) { return board_of(context).retained.data(); };
  keep(hal, {});  // cold coils
  hal.i2c = [](void* context, uint8_t, const uint8_t*, uint32_t, uint8_t* read, uint32_t count) {
    Board& own = board_of(context);
    const uint8_t said = own.next();
    for (uint32_t k = 0; k < count; ++k) read[k] = own.next();
    if (said > 250) return BusStatus::kStuck;
    return said > 240 ? BusStatus::kNoAnswer : BusStatus::kOk;
  };
  hal.recover_bus = [](void*) {};
  hal.panel_has_called = [](void* context) { return (board_of(context).next() & 1U) != 0; };
  add_flash(hal);
  hal.send = [](void*, const uint8_t*, uint32_t) {};
  hal.send_datagram = [](void*, const uint8_t*, uint32_t) {};
  // A MAC that a fuzzer hits: of zeros.
  hal.hmac_sha256 = [](void*, const uint8_t*, const uint8_t*, uint32_t, uint8_t* mac) {
    std::memset(mac, 0, 32);
    return true;
  };
  hal.random = [](void*) { return 7U; };
  hal.restart = [](void*) {};
  hal.reset_cause = [](void*) { return ResetCause::kPowerOn; };
  hal.print = [](void*, const char*) {};
  // A device that was never configured plays nothing, and a fuzzer would not get far.
  if (board.config[0] == 0xFF) {
    Config config{};
    config.pwm_pins = {4, 5, 12, 13, 14};  // any gates will do
    write_record(config, 1, board.config.data());
  }
  return hal;
}

}  // namespace chladni::fuzz
