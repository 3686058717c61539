#include "core/storage/stored_config.hpp"

namespace chladni {

void StoredConfig::load(const Hal& hal) {
  status_ = load_config(hal, config_);
  if (status_ != ConfigStatus::kBadPins) return;
  // The link goes on as the record says; nothing else of it is used.
  const uint32_t baud = config_.link_baud;
  config_ = Config{};
  config_.link_baud = baud;
}

bool StoredConfig::check(const Hal& hal) {
  Config found{};
  status_ = load_config(hal, found);
  return is_whole();
}

ConfigStatus StoredConfig::set(const Hal& hal, FlashWear& wear, const uint8_t* record,
                               uint32_t bytes, bool is_by_wire, uint32_t allowed_driver) const {
  Config wanted{};
  const ConfigStatus status = parse_record(record, bytes, hal.chip, wanted);
  if (status != ConfigStatus::kOk) return status;
  if (is_by_wire) {
    config_format::take_ceilings(wanted);
  } else if (!is_whole() || !may_ask_over_network(config_, wanted)) {
    return ConfigStatus::kByWireOnly;
  }
  const bool is_known = is_whole() || status_ == ConfigStatus::kOlder;
  const bool is_other = is_known && wanted.driver != config_.driver;
  if (is_other && wanted.driver != allowed_driver) return ConfigStatus::kOtherDriver;
  if (holds_config(hal, wanted)) return ConfigStatus::kOk;
  wear.spend(hal);
  wear.count(1);
  return save_config(hal, wanted);
}

}  // namespace chladni
