// The device's flash: what is loaded from it, written to it while outputs are off, and checked.
#include "core/device/device.hpp"
#include "core/storage/network_record.hpp"
#include "core/storage/retained.hpp"

namespace chladni {

using Status = link_format::Status;

void Device::load_config() {
  config_.load(hal_);
  if (config_status() == ConfigStatus::kNone) {
    stand(FaultCause::kNotConfigured, 0);
  } else if (!config_.is_whole()) {
    stand(FaultCause::kConfigRefused, static_cast<uint32_t>(config_status()));
  }
}

void Device::load_table() {
  faults_.clear(FaultCause::kNoTable);
  faults_.clear(FaultCause::kTableRefused);
  faults_.clear(FaultCause::kOlderTable);
  table_.load(hal_, config().channels);
  if (table_status() == TableStatus::kNone) {
    stand(FaultCause::kNoTable, 0);
  } else if (table_status() != TableStatus::kOk) {
    refuse_table();
  } else if (table_.store().is_older()) {
    faults_.raise(FaultCause::kOlderTable, 0, now_ms());  // a warning: it plays
  }
}

// A blank one is none, and fingers play the table's tone.
void Device::load_bank() {
  faults_.clear(FaultCause::kBankRefused);
  faults_.clear(FaultCause::kOlderBank);
  bank_.load(hal_);
  effects_.start(bank_.bank());
  const BankStatus status = bank_.status();
  if (status != BankStatus::kOk && status != BankStatus::kNone) {
    stand(FaultCause::kBankRefused, static_cast<uint32_t>(status));
  } else if (status == BankStatus::kOk && bank_.store().is_older()) {
    faults_.raise(FaultCause::kOlderBank, 0, now_ms());  // a warning: it plays
  }
}

void Device::refuse_table() {
  stand(FaultCause::kTableRefused, static_cast<uint32_t>(table_status()));
}

// Only while nothing plays.
void Device::load_again() {
  load_table();
  load_bank();
  start_outputs();
  input_.set_timeout(touch_timeout_us());
  input_.follow_all(table().has_responses());
}

bool Device::update_begin() {
  if (state_ != DeviceState::kUpdating) {
    if (!go(DeviceEvent::kUpdateBegins)) return false;
    silence();
  }
  return are_outputs_free();
}

void Device::update_end() {
  if (state_ != DeviceState::kUpdating || !is_quiet()) return;
  load_again();
  go(DeviceEvent::kUpdateEnds);
  settle();
}

// Until outputs are off it is already this update whose silence ends it.
bool Device::open_update(SlotUpdates& updates) {
  updates.hear(awake_ms());
  updated_ = &updates;
  return update_begin();
}

Status Device::begin_update(SlotUpdates& updates, uint32_t total_bytes, uint32_t file_crc) {
  if (!open_update(updates)) return Status::kBusy;
  const Status status = updates.begin(hal_, wear_, total_bytes, file_crc);
  keep_retained(false);
  if (status != Status::kOk) update_end();
  return status;
}

Status Device::write_update(SlotUpdates& updates, uint32_t offset, const uint8_t* bytes,
                            uint32_t count) {
  if (!is_updated(updates)) return Status::kNotBegun;
  updates.hear(awake_ms());
  return updates.write(hal_, offset, bytes, count);
}

Status Device::finish_update(Status status) {
  keep_retained(false);
  if (status != Status::kNotBegun) update_end();
  return status;
}

// The time that erasing took is no silence.
void Device::watch_update() {
  if (state_ != DeviceState::kUpdating) return;
  if (updated_->is_silent(awake_ms())) update_end();
}

Status Device::table_begin(uint32_t total_bytes, uint32_t table_crc, const uint8_t* header,
                           TableStatus& refused) {
  const Status status =
      table_.check_head(wear_, header, total_bytes, table_crc, config().channels, refused);
  if (status != Status::kOk) return status;
  return begin_update(table_.updates(), total_bytes, table_crc);
}

Status Device::table_data(uint32_t offset, const uint8_t* bytes, uint32_t count) {
  return write_update(table_.updates(), offset, bytes, count);
}

Status Device::table_commit() {
  if (!is_updated(table_.updates())) return Status::kNotBegun;
  return finish_update(table_.commit(hal_, wear_, config().channels));
}

Status Device::table_previous() {
  if (!may_write()) return Status::kTooOften;
  if (!open_update(table_.updates())) return Status::kBusy;
  return finish_update(table_.restore_other(hal_, wear_, config().channels));
}

Status Device::bank_begin(uint32_t total_bytes, uint32_t bank_crc, const uint8_t* header,
                          BankStatus& refused) {
  const Status status = bank_.check_head(hal_, wear_, header, total_bytes, bank_crc, refused);
  if (status != Status::kOk) return status;
  return begin_update(bank_.updates(), total_bytes, bank_crc);
}

Status Device::bank_data(uint32_t offset, const uint8_t* bytes, uint32_t count) {
  return write_update(bank_.updates(), offset, bytes, count);
}

Status Device::bank_commit() {
  if (!is_updated(bank_.updates())) return Status::kNotBegun;
  return finish_update(bank_.commit(hal_, wear_));
}

// What was spent is kept at once: a restart in the next moment must not give it back.
ConfigStatus Device::set_config(const uint8_t* record, uint32_t bytes, bool is_by_wire,
                                uint32_t allowed_driver) {
  const ConfigStatus status = config_.set(hal_, wear_, record, bytes, is_by_wire, allowed_driver);
  keep_retained(false);
  return status;
}

bool Device::set_network(const uint8_t* record, uint32_t size) {
  wear_.spend(hal_);
  wear_.count(1);
  keep_retained(false);
  return save_network(hal_, record, size);
}

// Once in so many samples, and before outputs go on.
void Device::keep_retained(bool is_on) {
  heat_.note(config(), known_heat_);
  Retained state;
  state.heat = known_heat_;
  state.is_on = is_on ? 1U : 0U;
  state.erases = erases();
  state.write_credit_ms = wear_.credit_ms();
  keep(hal_, state);
}

// What a bit has flipped in is not played from then on: the other table is, if it is whole, and
// without a configuration nothing.
void Device::watch_flash() {
  if (state_ == DeviceState::kUpdating || state_ == DeviceState::kRestarting) return;
  if (table_.is_damaged()) {
    if (are_outputs_free()) load_again();
    return;
  }
  if (table_.is_check_due(now_ms())) {
    check_config();
    table_.begin_check(now_ms());
    bank_.begin_check(now_ms());
  }
  if (!table_.check()) refuse_table();
  if (!bank_.check()) {
    stand(FaultCause::kBankRefused, static_cast<uint32_t>(bank_.status()));
  }
}

void Device::check_config() {
  if (!config_.is_whole() || config_.check(hal_)) return;
  stand(FaultCause::kConfigRefused, static_cast<uint32_t>(config_status()));
}

}  // namespace chladni
