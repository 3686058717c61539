// All fingers on a panel, each in a slot of its own from the report it counts from until it left.
//
// Panels number fingers, and swap or change numbers while fingers stay. So a finger is first looked
// for by its number, then by its place; two that would both have jumped, each to where the other
// was, have swapped numbers. Of more fingers than there are slots the oldest have them; the others
// are bystanders, who feel and have no voice.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/touch/panel.hpp"
#include "core/touch/panel_map.hpp"

namespace chladni {

// A finger that is down, by slot.
struct Contact {
  bool is_down = false;
  Place place{};
};
using Touches = std::array<Contact, kMaxFingers>;

// Where fingers without a slot are. They have no numbers: whoever is there is kept still.
struct Bystanders {
  uint32_t count = 0;
  std::array<Place, kMostListed> places{};
};

constexpr uint32_t count_of(const Touches& touches) {
  uint32_t count = 0;
  for (const Contact& one : touches) count += one.is_down ? 1U : 0U;
  return count;
}

class Contacts {
 public:
  // `timeout_us` without news ends a touch.
  void start(const Config& config, uint32_t timeout_us);

  // What a panel lists, those off its pixels left out. Without news no one moves
  // and no one comes.
  void take(const PanelReport& report, const PanelMap& map, bool is_news, uint32_t now_us);
  // Those leave that were absent for long enough, or of whom nothing was heard. Whether one of the
  // latter.
  bool pass(uint32_t now_us);
  void set_timeout(uint32_t timeout_us) { timeout_us_ = timeout_us; }

  // A finger that is gone for a moment is still down.
  Touches touches() const;
  const Bystanders& bystanders() const { return bystanders_; }
  // Also those that do not count yet.
  bool is_any_listed() const;
  // Gone, but perhaps for a moment only.
  bool is_any_lifting() const;

 private:
  // A finger moves no further from one report to the next, um.
  static constexpr uint32_t kReachUm = 8000;

  enum class Phase : uint8_t { kFree, kPressing, kDown, kLifting };

  struct Slot {
    Phase phase = Phase::kFree;
    uint8_t id = 0;
    uint32_t reports = 0;  // in a row, before it counts
    Place place{};
    uint32_t since_us = 0;  // of the last news, or of the report without it
  };

  // A finger of a report, and the slot that it belongs to.
  struct Found {
    uint8_t id;
    Place place;
    uint32_t slot;
  };
  static constexpr uint32_t kNoSlot = kMaxFingers;

  struct Listed {
    std::array<Found, kMostListed> fingers;
    uint32_t count;

    bool has(uint32_t slot) const {
      for (uint32_t k = 0; k < count; ++k) {
        if (fingers[k].slot == slot) return true;
      }
      return false;
    }
  };

  // Squared, um²; the longest are as long as 46 mm.
  static uint32_t distance2(Place one, Place other);
  bool is_in_reach(const Found& finger, uint32_t slot) const {
    return distance2(finger.place, slots_[slot].place) <= kReachUm * kReachUm;
  }
  void follow_numbers(Listed& listed) const;
  void follow_places(Listed& listed) const;
  void undo_swaps(Listed& listed) const;
  void keep(const Found& finger, uint32_t now_us);
  // False if no slot is free.
  bool begin(const Found& finger, uint32_t now_us);
  void miss(uint32_t number, uint32_t now_us);

  std::array<Slot, kMaxFingers> slots_{};
  Bystanders bystanders_{};
  uint32_t timeout_us_ = 100000;
  uint32_t hold_us_ = 0;
  uint32_t press_reports_ = 1;
};

}  // namespace chladni
