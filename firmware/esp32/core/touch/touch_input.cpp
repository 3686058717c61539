#include "core/touch/touch_input.hpp"

namespace chladni {

namespace {

constexpr uint32_t kSearchUs = 250000;
// A panel that does not call is asked all the same, once in so many reports.
constexpr uint32_t kIdleReports = 20;
// A panel that fails so often in a row is lost, and looked for again.
constexpr uint32_t kMostErrors = 3;
// Values of `panel` in the configuration.
constexpr uint8_t kNoPanel = 0, kFind = 1, kWantFt6x36 = 2, kWantGt911 = 3;

// Of the first that is down.
Place place_of(const Touches& touches) {
  for (const Contact& one : touches) {
    if (one.is_down) return one.place;
  }
  return {};
}

}  // namespace

void TouchInput::start(const Config& config, uint32_t timeout_us) {
  *this = TouchInput{};
  map_ = PanelMap(config);
  wanted_ = config.panel;
  has_line_ = config.interrupt_pin != 255;
  report_us_ = config.report_ms * 1000U;
  timeout_us_ = timeout_us;
  hold_us_ = config.lift_hold_ms * 1000U;
  press_reports_ = config.press_reports;
  contacts_.start(config, timeout_us);
  health_ = wanted_ == kNoPanel ? PanelHealth::kNone : PanelHealth::kMissing;
}

TouchEvent TouchInput::poll(const Hal& hal, uint32_t now_us) {
  const TouchEvent event = poll_panel(hal, now_us);
  if (event.kind != TouchKind::kNothing) held_ = {};
  if (!is_held()) return event;
  const Place place = place_of(held_);
  const bool is_silent =
      host_ != nullptr && now_us - heard_us_ >= link_format::kTouchSilenceMs * 1000U;
  if (!is_silent) return {TouchKind::kMoved, place};
  held_ = {};
  return {TouchKind::kSilent, place};
}

void TouchInput::set_timeout(uint32_t timeout_us) {
  timeout_us_ = timeout_us;
  contacts_.set_timeout(timeout_us);
}

Touches TouchInput::touches() const {
  if (is_held()) return held_;
  if (follows_all_) return contacts_.touches();
  Touches own{};
  own[0] = {is_touched_, place_};
  return own;
}

// What one host holds is not another's.
void TouchInput::hold(uint32_t finger, Place place, const void* host, uint32_t now_us) {
  if (host != host_) held_ = {};
  held_[finger] = {true, place};
  host_ = host;
  heard_us_ = now_us;
}

bool TouchInput::let_go(uint32_t finger) {
  const bool was_held = held_[finger].is_down;
  held_[finger] = {};
  return was_held && !is_held();
}

bool TouchInput::let_go() {
  const bool was_held = is_held();
  held_ = {};
  return was_held;
}

TouchEvent TouchInput::poll_panel(const Hal& hal, uint32_t now_us) {
  if (health_ == PanelHealth::kNone) return {};
  if (model_ == Model::kUnknown) {
    const bool is_time = !has_searched_ || now_us - searched_us_ >= kSearchUs;
    if (is_time) {
      has_searched_ = true;
      searched_us_ = now_us;
      find(hal);
    }
    return overdue(now_us);
  }
  if (!is_due(hal, now_us)) return overdue(now_us);
  asked_us_ = now_us;
  PanelReport report{};
  const PanelStatus status =
      model_ == Model::kFt6x36 ? ft6x36::read(hal, report) : gt911::read(hal, address_, report);
  if (status == PanelStatus::kNothingNew) return overdue(now_us);
  if (status != PanelStatus::kReport) {
    fail(hal, status);
    return overdue(now_us);
  }
  errors_in_row_ = 0;
  health_ = PanelHealth::kFine;
  if (report.is_palm) report.count = 0;
  // A GT911 marks its news. An FT6x36 calls for them; unasked, it may repeat what is long past, and
  // only that no finger touches it can be believed. Without its line there is no telling.
  const bool is_news = model_ == Model::kGt911 || !has_line_ || was_called_;
  const TouchEvent event = take(report, is_news, now_us);
  return event.kind == TouchKind::kNothing ? overdue(now_us) : event;
}

bool TouchInput::is_due(const Hal& hal, uint32_t now_us) {
  was_called_ = has_line_ && hal.panel_has_called(hal.context);
  if (was_called_) return true;
  const uint32_t since = now_us - asked_us_;
  // A call may get lost: a panel that should be reporting is asked all the same.
  // Most of all one under a finger; but a GT911 whose flag was never cleared calls no more.
  const bool is_busy = is_touched_ || pressed_ > 0 || contacts_.is_any_listed();
  if (has_line_) return since >= (is_busy ? 2U : kIdleReports) * report_us_;
  return since >= report_us_ / 4U;
}

void TouchInput::find(const Hal& hal) {
  Model found = Model::kUnknown;
  BusStatus worst = BusStatus::kNoAnswer;
  const auto note = [&worst](BusStatus status) {
    if (status == BusStatus::kStuck) worst = status;
    return status == BusStatus::kOk;
  };
  if ((wanted_ == kFind || wanted_ == kWantFt6x36) && note(ft6x36::start(hal))) {
    found = Model::kFt6x36;
  }
  for (const uint8_t address : gt911::kAddresses) {
    if (found != Model::kUnknown || wanted_ == kWantFt6x36) break;
    if (note(gt911::start(hal, address))) {
      found = Model::kGt911;
      address_ = address;
    }
  }
  if (found == Model::kUnknown) {
    ++bus_errors_;
    if (worst == BusStatus::kStuck) hal.recover_bus(hal.context);
    return;
  }
  model_ = found;
  errors_in_row_ = 0;
  health_ = PanelHealth::kFine;
}

void TouchInput::fail(const Hal& hal, PanelStatus status) {
  ++bus_errors_;
  if (status == PanelStatus::kStuck) hal.recover_bus(hal.context);
  if (++errors_in_row_ < kMostErrors) return;
  // Perhaps it was reset and has forgotten its settings: it is started again when found.
  health_ = PanelHealth::kWedged;
  model_ = Model::kUnknown;
}

TouchEvent TouchInput::take(const PanelReport& report, bool is_news, uint32_t now_us) {
  for (uint32_t k = 0; k < report.count; ++k) {
    if (!map_.contains(report.fingers[k])) ++out_of_range_;
  }
  if (follows_all_) return take_all(report, is_news, now_us);
  const Finger *own = nullptr, *first = nullptr;
  for (uint32_t k = 0; k < report.count; ++k) {
    const Finger& finger = report.fingers[k];
    if (!map_.contains(finger)) continue;
    if (first == nullptr) first = &finger;
    if (finger.id == owner_) own = &finger;
  }
  if (is_touched_) {
    // After a moment's absence any finger is taken for the same one.
    return follow(is_lifting_ && own == nullptr ? first : own, is_news, now_us);
  }
  if (first == nullptr) {
    pressed_ = 0;
    return {};
  }
  if (!is_news) return {};
  if (++pressed_ < press_reports_) return {};
  return begin(*first, now_us);
}

TouchEvent TouchInput::begin(const Finger& finger, uint32_t now_us) {
  is_touched_ = true;
  is_lifting_ = false;
  pressed_ = 0;
  owner_ = finger.id;
  place_ = map_.to_board(finger);
  news_us_ = now_us;
  return {TouchKind::kDown, place_};
}

TouchEvent TouchInput::follow(const Finger* own, bool is_news, uint32_t now_us) {
  if (own == nullptr) {
    if (hold_us_ == 0) return lift();
    if (!is_lifting_) lifting_us_ = now_us;
    is_lifting_ = true;
    return {};
  }
  if (!is_news) return {};
  is_lifting_ = false;
  owner_ = own->id;
  news_us_ = now_us;
  const Place place = map_.to_board(*own);
  const bool has_moved = place.x_um != place_.x_um || place.y_um != place_.y_um;
  place_ = place;
  return {has_moved ? TouchKind::kMoved : TouchKind::kHeld, place_};
}

TouchEvent TouchInput::lift() {
  is_touched_ = false;
  is_lifting_ = false;
  return {TouchKind::kUp, place_};
}

TouchEvent TouchInput::take_all(const PanelReport& report, bool is_news, uint32_t now_us) {
  const bool was_touched = is_touched_;
  contacts_.take(report, map_, is_news, now_us);
  const TouchEvent news{is_news ? TouchKind::kMoved : TouchKind::kNothing, place_};
  return since(was_touched, news);
}

TouchEvent TouchInput::overdue_all(uint32_t now_us) {
  const bool was_touched = is_touched_;
  const bool is_unheard = contacts_.pass(now_us);
  const TouchEvent held{contacts_.is_any_lifting() ? TouchKind::kHeld : TouchKind::kNothing,
                        place_};
  const TouchEvent event = since(was_touched, held);
  if (event.kind == TouchKind::kUp && is_unheard) return {TouchKind::kTimeout, event.place};
  return event;
}

TouchEvent TouchInput::since(bool was_touched, TouchEvent otherwise) {
  const Touches touches = contacts_.touches();
  is_touched_ = count_of(touches) > 0;
  if (is_touched_) otherwise.place = place_ = place_of(touches);
  if (!is_touched_) return {was_touched ? TouchKind::kUp : TouchKind::kNothing, place_};
  return was_touched ? otherwise : TouchEvent{TouchKind::kDown, place_};
}

TouchEvent TouchInput::overdue(uint32_t now_us) {
  if (follows_all_) return overdue_all(now_us);
  if (!is_touched_) return {};
  if (is_lifting_) {
    if (now_us - lifting_us_ >= hold_us_) return lift();
    return {TouchKind::kHeld, place_};
  }
  if (now_us - news_us_ < timeout_us_) return {};
  is_touched_ = false;
  return {TouchKind::kTimeout, place_};
}

}  // namespace chladni
