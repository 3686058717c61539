#include "core/device.hpp"

#include "core/text.hpp"

namespace chladni {

const char* to_text(DeviceState state) {
  switch (state) {
    case DeviceState::kNoTable: return "no table";
    case DeviceState::kIdle: return "idle";
    case DeviceState::kPlaying: return "playing";
    case DeviceState::kSpent: return "spent";
  }
  return "unknown";
}

TableStatus Device::start(const Hal& hal, const DeviceSettings& settings) {
  hal_ = hal;
  settings_ = settings;
  state_ = DeviceState::kNoTable;
  table_status_ = table_.load(hal_, settings.channels);
  SynthesisSettings synthesis{};
  synthesis.channels = settings.channels;
  synthesis.pwm_bits = settings.pwm_bits;
  // Without a table the synthesis still runs, and holds every output at 0.
  synthesis.frequency_mhz = table_.is_loaded() ? table_.frequency_mhz() : 160000U;
  synthesis.ramp_us = table_.is_loaded() ? table_.ramp_us() : 0U;
  synthesis.touch_timeout_us = table_.is_loaded() ? table_.touch_timeout_us() : 0U;
  synthesis.max_on_us = table_.is_loaded() ? table_.max_on_us() : 0U;
  const bool fits = synthesis_.start(synthesis);
  if (table_status_ == TableStatus::kOk && !fits) table_status_ = TableStatus::kBadField;
  if (table_status_ == TableStatus::kOk) state_ = DeviceState::kIdle;
  return table_status_;
}

void Device::poll() {
  if (state_ == DeviceState::kPlaying && !is_start_pending_) {
    const FadeCause cause = synthesis_.fade_cause();
    if (cause == FadeCause::kMaxOn) state_ = DeviceState::kSpent;
    if (cause == FadeCause::kTouchTimeout) state_ = DeviceState::kIdle;
  }
  Place place{};
  switch (hal_.poll_touch(hal_.context, &place)) {
    case Touch::kContact:
      is_console_touch_ = false;
      contact(place);
      break;
    case Touch::kLifted:
      is_console_touch_ = false;
      lifted();
      break;
    case Touch::kNothingNew:
      if (is_console_touch_) contact(console_place_);
      break;
  }
  if (state_ == DeviceState::kPlaying && is_drive_pending_) {
    Drive drive{};
    table_.drive_at(place_, drive);
    if (synthesis_.play(drive, settings_.level_q15, is_start_pending_)) {
      is_drive_pending_ = false;
      is_start_pending_ = false;
    }
  }
  // The lift-up may never be reported: a panel that has long been silent counts as one.
  const uint32_t now_us = hal_.now_us(hal_.context);
  if (state_ == DeviceState::kSpent && now_us - last_contact_us_ >= table_.touch_timeout_us()) {
    state_ = DeviceState::kIdle;
  }
  if (is_release_pending_) is_release_pending_ = !synthesis_.release();
}

void Device::contact(Place place) {
  last_contact_us_ = hal_.now_us(hal_.context);
  if (state_ == DeviceState::kNoTable || state_ == DeviceState::kSpent) return;
  if (state_ != DeviceState::kPlaying) is_start_pending_ = true;
  const bool has_moved = place.x_um != place_.x_um || place.y_um != place_.y_um;
  if (is_start_pending_ || has_moved) is_drive_pending_ = true;
  place_ = place;
  state_ = DeviceState::kPlaying;
  is_release_pending_ = false;
  synthesis_.keep_alive();
}

void Device::lifted() {
  if (state_ == DeviceState::kPlaying) is_release_pending_ = true;
  if (state_ != DeviceState::kNoTable) state_ = DeviceState::kIdle;
  is_drive_pending_ = false;
  is_start_pending_ = false;
}

// The drives of another frequency, from the next touch on; says how it went.
const char* Device::select_frequency(uint32_t frequency_mhz) {
  if (state_ == DeviceState::kNoTable) return to_text(table_status_);
  if (state_ != DeviceState::kIdle) return "lift the finger first";
  const TableStatus status = table_.select(hal_, frequency_mhz);
  if (!table_.is_loaded()) {
    table_status_ = status;
    state_ = DeviceState::kNoTable;
  }
  if (status == TableStatus::kOk) synthesis_.set_frequency(frequency_mhz);
  return to_text(status);
}

void Device::command(const char* line) {
  Reader reader(line);
  if (reader.word("touch")) {
    Place place{};
    if (reader.number(&place.x_um) && reader.number(&place.y_um) && reader.at_end()) {
      is_console_touch_ = true;
      console_place_ = place;
      hal_.print(hal_.context, table_.is_loaded() ? "ok" : to_text(table_status_));
      return;
    }
  } else if (reader.word("lift") && reader.at_end()) {
    is_console_touch_ = false;
    lifted();
    hal_.print(hal_.context, "ok");
    return;
  } else if (reader.word("frequency")) {
    int32_t frequency_mhz = 0;
    if (reader.number(&frequency_mhz) && reader.at_end() && frequency_mhz > 0) {
      hal_.print(hal_.context, select_frequency(static_cast<uint32_t>(frequency_mhz)));
      return;
    }
  } else if (reader.word("info") && reader.at_end()) {
    hal_.print(hal_.context, to_text(state_));
    hal_.print(hal_.context, to_text(table_status_));
    return;
  }
  hal_.print(hal_.context, "expected: touch X_UM Y_UM | lift | frequency MILLIHERTZ | info");
}

}  // namespace chladni
