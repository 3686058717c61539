// From a panel's reports to touches on the board: when to ask, what to believe, whose finger.
//
// Policy: the first finger down owns the touch until it lifts; then the first that the panel still
// lists begins a new touch. Where all fingers are followed, a touch lasts from the first to the
// last of them (contacts.hpp). A lift-up that never comes is made up for after a time without news,
// and a palm counts as no finger at all.
#pragma once

#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/generated/device_codes.hpp"
#include "core/generated/link_format.hpp"
#include "core/hal.hpp"
#include "core/touch/contacts.hpp"
#include "core/touch/panel.hpp"
#include "core/touch/panel_map.hpp"

namespace chladni {

enum class TouchKind : uint8_t {
  kNothing,
  kDown,
  kHeld,     // news: the finger is where it was
  kMoved,    // news: it is elsewhere
  kUp,       // it has left
  kTimeout,  // nothing was heard of it for too long
  kSilent,   // nor of the host that holds it
};

// Of a touch that ended by itself.
constexpr FaultCause cause_of(TouchKind kind) {
  return kind == TouchKind::kSilent ? FaultCause::kHostSilent : FaultCause::kTouchTimeout;
}

struct TouchEvent {
  TouchKind kind = TouchKind::kNothing;
  Place place{};
};

class TouchInput {
 public:
  // `timeout_us` without news ends a touch.
  void start(const Config& config, uint32_t timeout_us);
  // Of another table, while no finger counts.
  void set_timeout(uint32_t timeout_us);
  void follow_all(bool do_follow) { follows_all_ = do_follow; }
  // What happened since the last call; asks the panel if it is time to.
  TouchEvent poll(const Hal& hal, uint32_t now_us);
  // The fingers that are down: those that are followed, or that a host holds.
  Touches touches() const;
  // Of a panel whose fingers are followed: those that are down beside them.
  Bystanders bystanders() const {
    return follows_all_ && !is_held() ? contacts_.bystanders() : Bystanders{};
  }

  // A finger that a host or the console holds until it lets go, or a real one comes. A host, which
  // may be any address that is its own, must be heard again and again; a person at the console
  // (nullptr) need not type.
  void hold(uint32_t finger, Place place, const void* host, uint32_t now_us);
  bool is_held_by(const void* host) const { return is_held() && host_ == host; }
  // A request has come from that host.
  void hear(const void* host, uint32_t now_us) {
    if (host == host_) heard_us_ = now_us;
  }
  // One of them; whether it was there, and the last.
  bool let_go(uint32_t finger);
  // All of them; whether there was one.
  bool let_go();

  bool is_touched() const { return is_touched_ || is_held(); }
  PanelHealth health() const { return health_; }
  // Since start.
  uint32_t bus_errors() const { return bus_errors_; }
  uint32_t out_of_range() const { return out_of_range_; }

 private:
  enum class Model : uint8_t { kUnknown, kFt6x36, kGt911 };

  TouchEvent poll_panel(const Hal& hal, uint32_t now_us);
  void find(const Hal& hal);
  bool is_due(const Hal& hal, uint32_t now_us);
  TouchEvent take(const PanelReport& report, bool is_news, uint32_t now_us);
  TouchEvent follow(const Finger* own, bool is_news, uint32_t now_us);
  TouchEvent begin(const Finger& finger, uint32_t now_us);
  TouchEvent lift();
  TouchEvent overdue(uint32_t now_us);
  // The same where all fingers are followed.
  TouchEvent take_all(const PanelReport& report, bool is_news, uint32_t now_us);
  TouchEvent overdue_all(uint32_t now_us);
  TouchEvent since(bool was_touched, TouchEvent otherwise);
  bool is_held() const { return count_of(held_) > 0; }
  void fail(const Hal& hal, PanelStatus status);

  PanelMap map_;
  uint8_t wanted_ = 0;  // as in the configuration
  Model model_ = Model::kUnknown;
  uint8_t address_ = 0;
  bool has_line_ = false;
  bool was_called_ = false;
  uint32_t report_us_ = 10000;
  uint32_t timeout_us_ = 100000;
  uint32_t hold_us_ = 0;
  uint32_t press_reports_ = 1;
  PanelHealth health_ = PanelHealth::kNone;
  bool has_searched_ = false;
  uint32_t searched_us_ = 0;
  uint32_t asked_us_ = 0;
  uint32_t errors_in_row_ = 0;
  uint32_t bus_errors_ = 0;
  uint32_t out_of_range_ = 0;

  bool is_touched_ = false;
  uint8_t owner_ = 0;
  Place place_{};
  uint32_t news_us_ = 0;
  uint32_t pressed_ = 0;     // reports in a row with a finger, before it counts
  bool is_lifting_ = false;  // gone, but perhaps for a moment only
  uint32_t lifting_us_ = 0;
  bool follows_all_ = false;
  Contacts contacts_;
  Touches held_{};  // by a host or the console
  const void* host_ = nullptr;
  uint32_t heard_us_ = 0;
};

}  // namespace chladni
