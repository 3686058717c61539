// Runs one touch on the emulated board and prints a CRC of what the pins did.
//
//     program TABLE.chl X_UM Y_UM MILLISECONDS
//
// The same scenario in Python's emulator gives the same CRC, which shows that both are built from
// the same core. Exit codes: 0 done, 1 the device refused or failed, 2 wrong arguments.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "core/crc32.hpp"
#include "core/generated/table_format.hpp"
#include "emulator/emulator.hpp"

using chladni::emulator::Emulator;
using chladni::emulator::kSectorBytes;

namespace {

constexpr uint32_t kTouchAtUs = 5000;

std::vector<uint8_t> read_file(const char* path) {
  std::vector<uint8_t> bytes;
  std::FILE* file = std::fopen(path, "rb");
  if (file == nullptr) return bytes;
  for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
    bytes.push_back(static_cast<uint8_t>(c));
  }
  std::fclose(file);
  return bytes;
}

}  // namespace

int main(int count, char** words) {
  if (count != 5) {
    std::fprintf(stderr, "usage: %s TABLE.chl X_UM Y_UM MILLISECONDS\n", words[0]);
    return 2;
  }
  const std::vector<uint8_t> table = read_file(words[1]);
  if (table.size() < chladni::table_format::kHeaderBytes) {
    std::fprintf(stderr, "%s: not a table\n", words[1]);
    return 2;
  }
  const auto sectors = static_cast<uint32_t>(table.size() / kSectorBytes + 1);
  const uint32_t channels = table[chladni::table_format::kAtActuators];
  if (channels < 1 || channels > chladni::kMaxChannels) {
    std::fprintf(stderr, "%s: %u actuators\n", words[1], channels);
    return 2;
  }
  Emulator emulator({channels, 10, 26214, 10000, sectors});
  emulator.flash().program(0, table.data(), static_cast<uint32_t>(table.size()));
  const chladni::TableStatus status = emulator.boot();
  if (status != chladni::TableStatus::kOk) {
    std::fprintf(stderr, "%s: %s\n", words[1], chladni::to_text(status));
    return 1;
  }
  const chladni::Place place{std::atoi(words[2]), std::atoi(words[3])};
  emulator.add_finger({kTouchAtUs, true, place});
  emulator.run_us(static_cast<uint64_t>(std::atoi(words[4])) * 1000U);
  if (!emulator.fault().empty()) {
    std::fprintf(stderr, "%s\n", emulator.fault().c_str());
    return 1;
  }
  uint32_t crc = chladni::kCrc32Start;
  for (const uint16_t duty : emulator.pwm().take_record()) {
    const uint8_t bytes[] = {static_cast<uint8_t>(duty & 0xFF), static_cast<uint8_t>(duty >> 8)};
    crc = chladni::crc32_feed(crc, bytes, 2);
  }
  std::printf("%08x\n", crc ^ 0xFFFFFFFFU);
  return 0;
}
