// The configuration in force, and the one that a host writes for the next start.
#pragma once

#include <cstdint>

#include "core/storage/config.hpp"
#include "core/storage/flash_wear.hpp"

namespace chladni {

class StoredConfig {
 public:
  // From then on the newest whole record is in force, or defaults.
  void load(const Hal& hal);
  // Whether the record in force is still whole in flash; if not, the status says why.
  bool check(const Hal& hal);
  // Keep a record for the next start. Of drivers of another kind than those in force only where
  // `allowed_driver` is theirs: wired for the others, coils would play something else.
  ConfigStatus set(const Hal& hal, FlashWear& wear, const uint8_t* record, uint32_t bytes,
                   bool is_by_wire, uint32_t allowed_driver) const;

  const Config& in_force() const { return config_; }
  ConfigStatus status() const { return status_; }
  bool is_whole() const { return status_ == ConfigStatus::kOk; }

 private:
  Config config_{};
  ConfigStatus status_ = ConfigStatus::kNone;
};

}  // namespace chladni
