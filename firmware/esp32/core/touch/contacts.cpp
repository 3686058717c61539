#include "core/touch/contacts.hpp"

namespace chladni {

void Contacts::start(const Config& config, uint32_t timeout_us) {
  *this = Contacts{};
  timeout_us_ = timeout_us;
  hold_us_ = config.lift_hold_ms * 1000U;
  press_reports_ = config.press_reports;
}

uint32_t Contacts::distance2(Place one, Place other) {
  const auto clipped = [](int32_t um) -> uint32_t {
    const int32_t size = um < 0 ? -um : um;
    return static_cast<uint32_t>(size < 32767 ? size : 32767);
  };
  const uint32_t x = clipped(one.x_um - other.x_um), y = clipped(one.y_um - other.y_um);
  return x * x + y * y;
}

bool Contacts::is_any_listed() const {
  for (const Slot& slot : slots_) {
    if (slot.phase != Phase::kFree) return true;
  }
  return false;
}

bool Contacts::is_any_lifting() const {
  for (const Slot& slot : slots_) {
    if (slot.phase == Phase::kLifting) return true;
  }
  return false;
}

void Contacts::follow_numbers(Listed& listed) const {
  for (uint32_t k = 0; k < listed.count; ++k) {
    Found& finger = listed.fingers[k];
    for (uint32_t s = 0; s < kMaxFingers; ++s) {
      const Slot& slot = slots_[s];
      const bool is_it = slot.phase != Phase::kFree && slot.id == finger.id;
      if (is_it && !listed.has(s)) finger.slot = s;
    }
  }
}

// Of the rest: whoever is nearest to where one was.
void Contacts::follow_places(Listed& listed) const {
  for (;;) {
    Found* nearest = nullptr;
    uint32_t its_slot = kNoSlot;
    uint32_t least = kReachUm * kReachUm + 1;
    for (uint32_t k = 0; k < listed.count; ++k) {
      Found& finger = listed.fingers[k];
      if (finger.slot != kNoSlot) continue;
      for (uint32_t s = 0; s < kMaxFingers; ++s) {
        if (slots_[s].phase == Phase::kFree || listed.has(s)) continue;
        const uint32_t own = distance2(finger.place, slots_[s].place);
        if (own >= least) continue;
        least = own;
        nearest = &finger;
        its_slot = s;
      }
    }
    if (nearest == nullptr) return;
    nearest->slot = its_slot;
  }
}

void Contacts::undo_swaps(Listed& listed) const {
  for (uint32_t a = 0; a < listed.count; ++a) {
    for (uint32_t b = 0; b < a; ++b) {
      Found &one = listed.fingers[a], &other = listed.fingers[b];
      if (one.slot == kNoSlot || other.slot == kNoSlot) continue;
      const bool have_jumped = !is_in_reach(one, one.slot) && !is_in_reach(other, other.slot);
      if (!have_jumped || !is_in_reach(one, other.slot) || !is_in_reach(other, one.slot)) continue;
      const uint32_t slot = one.slot;
      one.slot = other.slot;
      other.slot = slot;
    }
  }
}

void Contacts::take(const PanelReport& report, const PanelMap& map, bool is_news, uint32_t now_us) {
  Listed listed{};
  for (uint32_t k = 0; k < report.count; ++k) {
    const Finger& finger = report.fingers[k];
    if (!map.contains(finger)) continue;
    listed.fingers[listed.count++] = {finger.id, map.to_board(finger), kNoSlot};
  }
  follow_numbers(listed);
  undo_swaps(listed);
  follow_places(listed);
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    if (!listed.has(s)) miss(s, now_us);
  }
  if (!is_news) return;
  bystanders_.count = 0;
  for (uint32_t k = 0; k < listed.count; ++k) {
    const Found& finger = listed.fingers[k];
    if (finger.slot != kNoSlot) {
      keep(finger, now_us);
    } else if (!begin(finger, now_us)) {
      bystanders_.places[bystanders_.count++] = finger.place;
    }
  }
}

void Contacts::keep(const Found& finger, uint32_t now_us) {
  Slot& slot = slots_[finger.slot];
  slot.id = finger.id;
  slot.place = finger.place;
  slot.since_us = now_us;
  if (slot.phase == Phase::kPressing && ++slot.reports < press_reports_) return;
  slot.phase = Phase::kDown;
}

// In the first free slot.
bool Contacts::begin(const Found& finger, uint32_t now_us) {
  for (Slot& slot : slots_) {
    if (slot.phase != Phase::kFree) continue;
    const Phase phase = press_reports_ <= 1 ? Phase::kDown : Phase::kPressing;
    slot = {phase, finger.id, 1, finger.place, now_us};
    return true;
  }
  return false;
}

void Contacts::miss(uint32_t number, uint32_t now_us) {
  Slot& slot = slots_[number];
  if (slot.phase == Phase::kFree || slot.phase == Phase::kLifting) return;
  if (slot.phase == Phase::kPressing || hold_us_ == 0) {
    slot = {};
    return;
  }
  slot.phase = Phase::kLifting;
  slot.since_us = now_us;
}

bool Contacts::pass(uint32_t now_us) {
  bool is_overdue = false;
  for (Slot& slot : slots_) {
    const uint32_t since = now_us - slot.since_us;
    if (slot.phase == Phase::kLifting && since >= hold_us_) slot = {};
    if (slot.phase == Phase::kFree || slot.phase == Phase::kLifting || since < timeout_us_)
      continue;
    is_overdue = is_overdue || slot.phase == Phase::kDown;
    slot = {};
  }
  return is_overdue;
}

Touches Contacts::touches() const {
  Touches found{};
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    const Phase phase = slots_[s].phase;
    found[s] = {phase == Phase::kDown || phase == Phase::kLifting, slots_[s].place};
  }
  return found;
}

}  // namespace chladni
