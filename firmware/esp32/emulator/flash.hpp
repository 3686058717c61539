// Flash as the chip has it: 4 KiB sectors erased to 0xFF, bits programmed from 1 to 0 only.
// Setting a bit from 0 to 1 without an erase is a fault here, where silicon would just not do it.
// On command the power fails in the middle of an operation, or one is not done though it says so.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/hal.hpp"

namespace chladni::emulator {

class Flash {
 public:
  explicit Flash(uint32_t sectors) : bytes_(sectors * kSectorBytes, 0xFF) {}

  uint32_t size() const { return static_cast<uint32_t>(bytes_.size()); }
  const std::vector<uint8_t>& bytes() const { return bytes_; }
  // Erased and programmed so far: whoever keeps a copy knows by it when to look.
  uint64_t changes() const { return changes_; }

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
    if (does_lie_ || is_cut()) return {};
    ++changes_;
    const uint32_t done = allowance(kSectorBytes);
    for (uint32_t k = 0; k < done; ++k) bytes_[offset + k] = 0xFF;
    return {};
  }

  std::string program(uint32_t offset, const uint8_t* data, uint32_t count) {
    if (offset > size() || count > size() - offset) {
      return "programme at " + std::to_string(offset) + " leaves the partition";
    }
    if (is_cut()) return {};
    for (uint32_t k = 0; k < count; ++k) {
      if ((data[k] & ~bytes_[offset + k]) != 0) {
        return "byte " + std::to_string(offset + k) + " programmed from 0 to 1 without an erase";
      }
    }
    if (does_lie_) return {};
    ++changes_;
    const uint32_t done = allowance(count);
    for (uint32_t k = 0; k < done; ++k) bytes_[offset + k] = data[k];
    return {};
  }

  // After so many more bytes erased or programmed the power fails; what comes later is lost.
  void cut_after(uint32_t bytes) {
    is_cut_set_ = true;
    left_ = bytes;
  }
  bool is_cut() const { return is_cut_set_ && left_ == 0; }
  void restore_power() { is_cut_set_ = false; }
  void set_lying(bool does_lie) { does_lie_ = does_lie; }

 private:
  uint32_t allowance(uint32_t count) {
    if (!is_cut_set_) return count;
    const uint32_t done = count < left_ ? count : left_;
    left_ -= done;
    return done;
  }

  std::vector<uint8_t> bytes_;
  uint64_t changes_ = 0;
  bool is_cut_set_ = false;
  uint32_t left_ = 0;
  bool does_lie_ = false;
};

}  // namespace chladni::emulator
