#include "core/storage/network_record.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

namespace f = network_format;
using Record = std::array<uint8_t, f::kRecordBytes>;

constexpr uint32_t kCrcBytes = 4;

// `text` has room for a zero behind so many bytes.
void take_text(const uint8_t* bytes, uint32_t count, char* text) {
  for (uint32_t k = 0; k < count; ++k) text[k] = static_cast<char>(bytes[k]);
  text[count] = '\0';
}

bool read(const Hal& hal, Record& record) {
  return hal.read_flash(hal.context, FlashArea::kNetwork, 0, record.data(), f::kRecordBytes);
}

}  // namespace

bool parse_network(const uint8_t* record, uint32_t size, Network& network) {
  if (size != f::kRecordBytes || read_u32(record + f::kRecordAtMagic) != f::kRecordMagic ||
      read_u16(record + f::kRecordAtVersion) != f::kVersion) {
    return false;
  }
  constexpr uint32_t kCovered = f::kRecordBytes - kCrcBytes;
  const uint32_t crc = crc32(record, kCovered);
  const uint32_t port = read_u16(record + f::kRecordAtPort);
  uint32_t any = 0;
  for (uint32_t k = 0; k < f::kKeyBytes; ++k) any |= record[f::kRecordAtKey + k];
  if (read_u32(record + kCovered) != crc || port < f::kLowestPort || any == 0) return false;
  network.port = static_cast<uint16_t>(port);
  for (uint32_t k = 0; k < f::kKeyBytes; ++k) network.key[k] = record[f::kRecordAtKey + k];
  take_text(record + f::kRecordAtSsid, f::kSsidBytes, network.ssid.data());
  take_text(record + f::kRecordAtPassphrase, f::kPassphraseBytes, network.passphrase.data());
  return true;
}

bool load_network(const Hal& hal, Network& network) {
  Record record{};
  return read(hal, record) && parse_network(record.data(), f::kRecordBytes, network);
}

bool save_network(const Hal& hal, const uint8_t* record, uint32_t size) {
  if (!hal.erase_sector(hal.context, FlashArea::kNetwork, 0)) return false;
  if (size > 0 && !hal.program_flash(hal.context, FlashArea::kNetwork, 0, record, size)) {
    return false;
  }
  Record written{};
  if (!read(hal, written)) return false;
  for (uint32_t k = 0; k < f::kRecordBytes; ++k) {
    if (written[k] != (k < size ? record[k] : 0xFFU)) return false;
  }
  return true;
}

}  // namespace chladni
