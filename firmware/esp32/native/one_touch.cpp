// Runs one touch on the emulated board and prints a CRC of what the pins did.
//
//     program TABLE.chl CONFIG X_MM Y_MM MILLISECONDS
//
// The same scenario in Python's emulator gives the same CRC, which shows that both are built from
// the same core. Exit codes: 0 done, 1 the device refused or failed, 2 wrong arguments.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/crc32.hpp"
#include "emulator/emulator.hpp"

using chladni::kSectorBytes;
using chladni::emulator::Emulator;

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
  if (count != 6) {
    std::fprintf(stderr, "usage: %s TABLE.chl CONFIG X_MM Y_MM MILLISECONDS\n", words[0]);
    return 2;
  }
  const std::vector<uint8_t> table = read_file(words[1]), config = read_file(words[2]);
  chladni::emulator::Hardware hardware;
  hardware.table_sectors = static_cast<uint32_t>(table.size() / kSectorBytes + 1);
  Emulator emulator(hardware);
  std::string wrong =
      emulator.tables().program(0, table.data(), static_cast<uint32_t>(table.size()));
  if (wrong.empty()) {
    wrong = emulator.config().program(0, config.data(), static_cast<uint32_t>(config.size()));
  }
  if (!wrong.empty()) {
    std::fprintf(stderr, "%s\n", wrong.c_str());
    return 2;
  }
  emulator.boot(chladni::ResetCause::kPowerOn);
  const chladni::Device& device = emulator.device();
  if (device.config_status() != chladni::ConfigStatus::kOk) {
    std::fprintf(stderr, "%s: %s\n", words[2], to_text(device.config_status()));
    return 1;
  }
  if (device.table_status() != chladni::TableStatus::kOk) {
    std::fprintf(stderr, "%s: %s\n", words[1], to_text(device.table_status()));
    return 1;
  }
  emulator.add_finger({kTouchAtUs, 0, true, std::atof(words[3]), std::atof(words[4])});
  emulator.run_us(static_cast<uint64_t>(std::atoi(words[5])) * 1000U);
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
