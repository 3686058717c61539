#include "core/storage/config.hpp"

#include <cstddef>

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"
#include "core/base/flash_crc.hpp"

namespace chladni {

namespace {

namespace f = config_format;
using Record = std::array<uint8_t, f::kRecordBytes>;

constexpr uint32_t kSectors = 2;
// A record of a later minor version may be longer, but not than this.
constexpr uint32_t kMostBytes = 1024;
// The last word of a sector, programmed to 0 once a newer record is whole in the other one. If that
// record is gone later on, it was not a cut while writing that took it.
constexpr uint32_t kReplacedAt = kSectorBytes - 4U;
constexpr uint32_t kReplacedBits = 16;  // of 32; a few flipped bits change nothing

struct TakeWithin {
  template <typename T>
  bool operator()(const uint8_t* at, int32_t low, int32_t high, T& value) const {
    const auto found = static_cast<T>(word(at, sizeof(T)));
    // Fields of 32 bits are far from both ends of int32_t, so that this comparison is exact.
    const auto wide = static_cast<int32_t>(found);
    if (wide < low || wide > high) return false;
    value = found;
    return true;
  }
  template <typename T, size_t kCount>
  bool operator()(const uint8_t* at, int32_t low, int32_t high,
                  std::array<T, kCount>& values) const {
    for (size_t k = 0; k < kCount; ++k) {
      if (!(*this)(at + k * sizeof(T), low, high, values[k])) return false;
    }
    return true;
  }
};

// What a shorter record of an earlier minor version lacks counts as 0.
bool take_all(Record& record, uint32_t total, Config& config) {
  for (uint32_t k = total - f::kCrcBytes; k < f::kRecordBytes; ++k) record[k] = 0;
  return f::take_fields(record.data(), config, TakeWithin{});
}

struct Found {
  ConfigStatus status;
  uint32_t sequence;
  Config config;
};

// Bytes of a record that begins like one and has at most `most`; else 0.
uint32_t total_of(const uint8_t* record, uint32_t most) {
  const uint32_t total = read_u16(record + f::kAtTotalBytes);
  const bool is_one =
      read_u32(record + f::kAtMagic) == f::kMagic && record[f::kAtVersionMajor] == f::kVersionMajor;
  return is_one && total >= f::kLeastRecordBytes && total <= most ? total : 0U;
}

Found read_sector(const Hal& hal, uint32_t sector) {
  Found found{ConfigStatus::kDamaged, 0, {}};
  Record record{};
  const uint32_t offset = sector * kSectorBytes;
  if (!hal.read_flash(hal.context, FlashArea::kConfig, offset, record.data(), f::kRecordBytes)) {
    found.status = ConfigStatus::kReadFailed;
    return found;
  }
  if (word(record.data(), 4) == 0xFFFFFFFFU) {
    found.status = ConfigStatus::kNone;
    return found;
  }
  if (read_u32(record.data() + f::kAtMagic) == f::kMagic &&
      record[f::kAtVersionMajor] != f::kVersionMajor) {
    found.status = ConfigStatus::kBadVersion;
    return found;
  }
  const uint32_t total = total_of(record.data(), kMostBytes);
  uint32_t crc = 0;
  if (total == 0 ||
      check_flash_crc(hal, FlashArea::kConfig, offset, total, crc) != FlashCrc::kRight) {
    return found;
  }
  if (!take_all(record, total, found.config)) return found;
  found.sequence = word(record.data() + f::kAtSequence, 4);
  found.status = ConfigStatus::kOk;
  return found;
}

bool is_replaced(const Hal& hal, uint32_t sector) {
  std::array<uint8_t, 4> mark{};
  const uint32_t offset = sector * kSectorBytes + kReplacedAt;
  if (!hal.read_flash(hal.context, FlashArea::kConfig, offset, mark.data(), 4)) return false;
  uint32_t zeros = 0;
  for (uint32_t left = ~word(mark.data(), 4); left != 0; left &= left - 1U) ++zeros;
  return zeros > kReplacedBits;
}

void mark_replaced(const Hal& hal, uint32_t sector) {
  if (is_replaced(hal, sector)) return;
  const std::array<uint8_t, 4> mark{};
  const uint32_t offset = sector * kSectorBytes + kReplacedAt;
  hal.program_flash(hal.context, FlashArea::kConfig, offset, mark.data(), 4);
}

// The sector with the newest whole record; `kSectors` if there is none.
uint32_t newest(const Found& first, const Found& second) {
  const bool has_first = first.status == ConfigStatus::kOk;
  const bool has_second = second.status == ConfigStatus::kOk;
  if (!has_first) return has_second ? 1U : kSectors;
  if (!has_second) return 0U;
  // Sequence numbers may wrap around.
  return static_cast<int32_t>(second.sequence - first.sequence) > 0 ? 1U : 0U;
}

// Takes pins one by one: each must be able to be what it is for, and none comes twice.
class PinCheck {
 public:
  void take(uint32_t pin, uint64_t allowed) {
    if (bad_ != kNoBadPin) return;
    const bool is_able = pin < 64U && ((allowed >> pin) & 1U) != 0;
    if (!is_able || ((taken_ >> pin) & 1U) != 0) {
      bad_ = pin;
      return;
    }
    taken_ |= 1ULL << pin;
  }
  void take_if_wired(uint32_t pin, uint64_t allowed) {
    if (pin != gpio::kNotWired) take(pin, allowed);
  }
  uint32_t bad() const { return bad_; }

 private:
  uint64_t taken_ = 0;
  uint32_t bad_ = kNoBadPin;
};

}  // namespace

uint32_t bad_pin(const Config& config, gpio::Chip chip) {
  const gpio::Abilities& able = gpio::kAbilities[static_cast<uint32_t>(chip)];
  // A channel that the chip does not have can be nowhere.
  if (config.channels > able.channels) return config.pwm_pins[able.channels];
  PinCheck check;
  for (uint32_t k = 0; k < config.channels; ++k) check.take(config.pwm_pins[k], able.gates);
  if (config.driver == kBridge) {
    if (config.channels > gpio::kMostBridges) return config.sign_pins[gpio::kMostBridges];
    for (uint32_t k = 0; k < config.channels; ++k) check.take(config.sign_pins[k], able.signs);
  }
  if (config.panel != 0) {
    check.take(config.sda_pin, able.bus);
    check.take(config.scl_pin, able.bus);
    check.take_if_wired(config.interrupt_pin, able.inputs);
    check.take_if_wired(config.reset_pin, able.outputs);
  }
  if (has_sensing_pin(config)) check.take(config.sense_pin, able.converters);
  return check.bad();
}

ConfigStatus load_config(const Hal& hal, Config& config) {
  const Found first = read_sector(hal, 0), second = read_sector(hal, 1);
  const uint32_t sector = newest(first, second);
  if (sector < kSectors) {
    config = sector == 0 ? first.config : second.config;
    if (bad_pin(config, hal.chip) != kNoBadPin) return ConfigStatus::kBadPins;
    if (is_replaced(hal, sector)) return ConfigStatus::kOlder;
    // A cut may have come before the older one was marked.
    const ConfigStatus other = sector == 0 ? second.status : first.status;
    if (other == ConfigStatus::kOk) mark_replaced(hal, 1U - sector);
    return ConfigStatus::kOk;
  }
  config = Config{};
  if (first.status == ConfigStatus::kNone && second.status == ConfigStatus::kNone) {
    return ConfigStatus::kNone;
  }
  return first.status == ConfigStatus::kNone ? second.status : first.status;
}

ConfigStatus parse_settings(const uint8_t* record, uint32_t bytes, Config& config) {
  if (bytes < f::kLeastRecordBytes) return ConfigStatus::kDamaged;
  const uint32_t total = total_of(record, bytes);
  if (total == 0) return ConfigStatus::kDamaged;
  const uint32_t covered = total - f::kCrcBytes;
  const uint32_t crc = crc32(record, covered);
  if (word(record + covered, 4) != crc) return ConfigStatus::kDamaged;
  Record copy{};
  const uint32_t most = f::kRecordBytes;
  for (uint32_t k = 0; k < (total < most ? total : most); ++k) copy[k] = record[k];
  return take_all(copy, total, config) ? ConfigStatus::kOk : ConfigStatus::kDamaged;
}

ConfigStatus parse_record(const uint8_t* record, uint32_t bytes, gpio::Chip chip, Config& config) {
  const ConfigStatus status = parse_settings(record, bytes, config);
  if (status != ConfigStatus::kOk) return status;
  return bad_pin(config, chip) == kNoBadPin ? ConfigStatus::kOk : ConfigStatus::kBadPins;
}

void write_record(const Config& config, uint32_t sequence, uint8_t* record) {
  const Put put{};
  put(record + f::kAtMagic, f::kMagic);
  record[f::kAtVersionMajor] = static_cast<uint8_t>(f::kVersionMajor);
  record[f::kAtVersionMinor] = static_cast<uint8_t>(f::kVersionMinor);
  put(record + f::kAtTotalBytes, static_cast<uint16_t>(f::kRecordBytes));
  put(record + f::kAtSequence, sequence);
  f::put_fields(record, config, put);
  const uint32_t covered = f::kRecordBytes - f::kCrcBytes;
  put(record + covered, crc32(record, covered));
}

bool holds_config(const Hal& hal, const Config& config) {
  const Found first = read_sector(hal, 0), second = read_sector(hal, 1);
  const uint32_t holds = newest(first, second);
  return holds != kSectors && !is_replaced(hal, holds) &&
         f::are_same(config, (holds == 0 ? first : second).config);
}

ConfigStatus save_config(const Hal& hal, const Config& config) {
  const Found first = read_sector(hal, 0), second = read_sector(hal, 1);
  const uint32_t holds = newest(first, second);
  const uint32_t sequence = holds == kSectors ? 0U : (holds == 0 ? first : second).sequence;
  const uint32_t sector = holds == 0 ? 1U : 0U;
  Record record{};
  write_record(config, sequence + 1U, record.data());
  const uint32_t offset = sector * kSectorBytes;
  if (!hal.erase_sector(hal.context, FlashArea::kConfig, offset) ||
      !hal.program_flash(hal.context, FlashArea::kConfig, offset, record.data(), f::kRecordBytes)) {
    return ConfigStatus::kWriteFailed;
  }
  // Flash has been seen to answer OK and write nothing.
  const Found written = read_sector(hal, sector);
  const bool is_there = written.status == ConfigStatus::kOk && written.sequence == sequence + 1U;
  if (is_there && holds != kSectors) mark_replaced(hal, holds);
  return is_there ? ConfigStatus::kOk : ConfigStatus::kWriteFailed;
}

bool may_ask_over_network(const Config& in_force, const Config& wanted) {
  // As the record in force would be with all that a network may change.
  Config allowed = in_force;
  f::copy_up_to_ceilings(wanted, allowed);
  f::copy_harmless(wanted, allowed);
  return f::are_same(wanted, allowed);
}

}  // namespace chladni
