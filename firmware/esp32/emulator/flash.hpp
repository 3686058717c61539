// Flash as the chip has it: 4 KiB sectors erased to 0xFF, bits programmed from 1 to 0 only.
// Setting a bit from 0 to 1 without an erase is a fault here, where silicon would just not do it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chladni::emulator {

constexpr uint32_t kSectorBytes = 4096;

class Flash {
 public:
  explicit Flash(uint32_t sectors) : bytes_(sectors * kSectorBytes, 0xFF) {}

  uint32_t size() const { return static_cast<uint32_t>(bytes_.size()); }

  bool read(uint32_t offset, uint8_t* out, uint32_t count) const {
    if (offset > size() || count > size() - offset) return false;
    for (uint32_t k = 0; k < count; ++k) out[k] = bytes_[offset + k];
    return true;
  }

  // Both return what is wrong, or an empty string.
  std::string erase_sector(uint32_t offset) {
    if (offset % kSectorBytes != 0 || offset >= size()) {
      return "erase at " + std::to_string(offset) + " is not the start of a sector";
    }
    for (uint32_t k = 0; k < kSectorBytes; ++k) bytes_[offset + k] = 0xFF;
    return {};
  }

  std::string program(uint32_t offset, const uint8_t* data, uint32_t count) {
    if (offset > size() || count > size() - offset) {
      return "programme at " + std::to_string(offset) + " leaves the partition";
    }
    for (uint32_t k = 0; k < count; ++k) {
      if ((data[k] & ~bytes_[offset + k]) != 0) {
        return "byte " + std::to_string(offset + k) + " programmed from 0 to 1 without an erase";
      }
    }
    for (uint32_t k = 0; k < count; ++k) bytes_[offset + k] = data[k];
    return {};
  }

 private:
  std::vector<uint8_t> bytes_;
};

}  // namespace chladni::emulator
