// What lies in flash: the table and the configuration, their updates, and whether they are still
// what was written.
#include "core/device/device.hpp"

namespace chladni {

namespace {

constexpr uint32_t kCheckEveryMs = 60000;

link_format::Status to_link(StoreStatus status) {
  using Status = link_format::Status;
  switch (status) {
    case StoreStatus::kOk: return Status::kOk;
    case StoreStatus::kTooLarge: return Status::kTooLarge;
    case StoreStatus::kNotBegun: return Status::kNotBegun;
    case StoreStatus::kWrongOffset: return Status::kWrongOffset;
    case StoreStatus::kFlashFailed: return Status::kFlashFailed;
    case StoreStatus::kRefused: return Status::kRefused;
    case StoreStatus::kNoOther: return Status::kNoOther;
  }
  return Status::kMalformed;
}

}  // namespace

void Device::load_table() {
  faults_.clear(FaultCause::kNoTable);
  faults_.clear(FaultCause::kTableRefused);
  faults_.clear(FaultCause::kOlderTable);
  flash_check_ = FlashCheck{};
  table_status_ = store_.load(hal_, table_, config_.channels);
  if (table_status_ == TableStatus::kNone) {
    stand(FaultCause::kNoTable, 0);
  } else if (table_status_ != TableStatus::kOk) {
    stand(FaultCause::kTableRefused, static_cast<uint32_t>(table_status_));
  } else if (store_.is_older()) {
    warn(FaultCause::kOlderTable, 0);
  }
}

// Only while nothing plays.
void Device::load_again() {
  load_table();
  start_outputs();
  input_.set_timeout(table_.is_loaded() ? table_.touch_timeout_us() : kDefaultTimeoutUs);
}

bool Device::update_begin() {
  if (state_ != DeviceState::kUpdating) {
    if (!go(DeviceEvent::kUpdateBegins)) return false;
    silence();
  }
  return post_ != Post::kRelease && synthesis_.is_quiet();
}

void Device::update_end() {
  if (state_ != DeviceState::kUpdating || !synthesis_.is_quiet()) return;
  store_.abandon();
  load_again();
  go(DeviceEvent::kUpdateEnds);
  settle();
}

link_format::Status Device::table_begin(uint32_t total_bytes, uint32_t table_crc,
                                        const uint8_t* header, TableStatus& refused) {
  using Status = link_format::Status;
  if (total_bytes == 0 || total_bytes > store_format::kTrailerOffset) return Status::kTooLarge;
  // Before anything is erased: what would be refused must not cost the table to go back to.
  if (!may_write()) return Status::kTooOften;
  refused = Table::check_head(header, total_bytes, config_.channels);
  if (refused != TableStatus::kOk) return Status::kRefused;
  update_ms_ = awake_ms();
  if (!update_begin()) return Status::kBusy;
  const uint32_t before = store_.erases();
  const Status status = to_link(store_.begin(hal_, total_bytes, table_crc));
  if (store_.erases() != before) count_write();
  if (status != Status::kOk) update_end();
  return status;
}

link_format::Status Device::table_data(uint32_t offset, const uint8_t* bytes, uint32_t count) {
  if (state_ != DeviceState::kUpdating) return link_format::Status::kNotBegun;
  update_ms_ = awake_ms();
  return to_link(store_.write(hal_, offset, bytes, count));
}

link_format::Status Device::table_commit() {
  if (state_ != DeviceState::kUpdating) return link_format::Status::kNotBegun;
  const StoreStatus status = store_.commit(hal_, table_, config_.channels);
  if (status != StoreStatus::kNotBegun) update_end();
  return to_link(status);
}

link_format::Status Device::table_previous() {
  update_ms_ = awake_ms();
  if (!update_begin()) return link_format::Status::kBusy;
  const StoreStatus status = store_.restore_other(hal_, table_, config_.channels);
  update_end();
  return to_link(status);
}

void Device::watch_update() {
  // The time that erasing took is no silence.
  const bool is_silent = awake_ms() - update_ms_ >= link_format::kUpdateSilenceMs;
  if (state_ == DeviceState::kUpdating && is_silent) update_end();
}

ConfigStatus Device::set_config(const uint8_t* record, uint32_t bytes, bool is_by_wire) {
  Config wanted{};
  const ConfigStatus status = parse_record(record, bytes, wanted);
  if (status != ConfigStatus::kOk) return status;
  if (is_by_wire) {
    config_format::take_ceilings(wanted);
  } else if (!is_configured() || !may_ask_over_network(config_, wanted)) {
    return ConfigStatus::kByWireOnly;
  }
  const uint32_t before = other_erases_;
  const ConfigStatus saved = save_config(hal_, wanted, other_erases_);
  if (other_erases_ != before) count_write();
  return saved;
}

bool Device::set_network(const uint8_t* record, uint32_t size) {
  ++other_erases_;
  count_write();
  return save_network(hal_, record, size);
}

// A restart in the next moment must not give it back.
void Device::count_write() {
  writes_.spend();
  keep_retained(false);
}

// Once in so many samples, and before outputs go on.
void Device::keep_retained(bool is_on) const {
  Retained state;
  state.is_on = is_on ? 1U : 0U;
  for (uint32_t k = 0; k < config_.channels; ++k) state.rise_uk[k] = heat_.rise_uk(k);
  state.erases = erases();
  state.write_credit_ms = writes_.credit_ms();
  keep(hal_, state);
}

// One pass a minute, a little of it each turn. What a bit has flipped in is not played from then
// on: the other table is, if it is whole, and without a configuration nothing.
void Device::watch_flash() {
  if (state_ == DeviceState::kUpdating || state_ == DeviceState::kRestarting) return;
  if (must_load_) {
    if (post_ == Post::kRelease || !synthesis_.is_quiet()) return;
    must_load_ = false;
    load_again();
    return;
  }
  if (flash_check_.is_due(now_ms(), kCheckEveryMs)) {
    check_config();
    flash_check_.begin(now_ms(), table_.is_loaded() ? table_.total_bytes() : 0);
  }
  if (!flash_check_.is_under_way()) return;
  if (flash_check_.advance(table_.bytes()) == FlashCrc::kWrong) table_is_damaged();
}

void Device::check_config() {
  if (!is_configured() || faults_.stands(FaultCause::kConfigRefused)) return;
  Config found{};
  const ConfigStatus status = load_config(hal_, found);
  if (status == ConfigStatus::kOk) return;
  config_status_ = status;
  stand(FaultCause::kConfigRefused, static_cast<uint32_t>(status));
}

void Device::table_is_damaged() {
  table_status_ = TableStatus::kBadCrc;
  stand(FaultCause::kTableRefused, static_cast<uint32_t>(table_status_));
  must_load_ = true;
}

}  // namespace chladni
