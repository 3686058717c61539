#include "core/effects/finger_effects.hpp"

namespace chladni {

namespace {

namespace f = bank_format;

int32_t floor_of(int32_t value, int32_t step) {
  return value >= 0 ? value / step : -((-value + step - 1) / step);
}

// The coordinate that an area's steps are counted along, from where its shape begins.
int32_t along(const BankArea& area, Place place) {
  const Place origin = box_of(area).least;
  return area.along == f::kAlongX ? place.x_um - origin.x_um : place.y_um - origin.y_um;
}

// 80 MHz / 2^15 of them in a second.
uint32_t milliseconds_of(uint32_t samples) { return samples * 1000U / 2441U; }

}  // namespace

void FingerEffects::start(const Bank& bank) {
  bank_ = &bank;
  fingers_ = {};
  events_.forget();
}

void FingerEffects::note(AreaEvent what, uint32_t slot, uint32_t now_ms) {
  events_.add({now_ms, what, slot, fingers_[slot].area, fingers_[slot].place});
}

Touches FingerEffects::follow(const Touches& touches, uint32_t heard, uint32_t now_ms) {
  if (!has_bank()) return touches;
  Touches all = touches;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    FingerEffect& finger = fingers_[s];
    const bool is_lingering = finger.phase == Phase::kLingering;
    if (is_lingering && static_cast<int32_t>(now_ms - finger.ends_ms) >= 0) finger = {};
    if (!touches[s].is_down) {
      if (finger.phase == Phase::kDown) release(s, (heard >> s & 1U) != 0, now_ms);
      if (finger.phase == Phase::kLingering) all[s] = {true, finger.place};
    } else if (finger.phase == Phase::kDown) {
      move(s, touches[s].place, now_ms);
    } else if (is_lingering) {
      // Another finger than the one that left: it comes down in the next turn.
      finger = {};
      all[s] = {};
    } else {
      press(s, touches[s].place, now_ms);
    }
  }
  return all;
}

bool FingerEffects::are_lingering() const {
  for (const FingerEffect& finger : fingers_) {
    if (finger.phase == Phase::kLingering) return true;
  }
  return false;
}

void FingerEffects::press(uint32_t slot, Place place, uint32_t now_ms) {
  FingerEffect& finger = fingers_[slot];
  finger = {};
  finger.phase = Phase::kDown;
  finger.is_new = true;
  finger.place = place;
  finger.area = area_at(*bank_, place, kNoArea);
  note(AreaEvent::kPressed, slot, now_ms);
  if (finger.area == kNoArea) return;
  begin_steps(finger);
  begin(finger, bank_->area(finger.area).press);
  hold(finger);
}

void FingerEffects::move(uint32_t slot, Place place, uint32_t now_ms) {
  FingerEffect& finger = fingers_[slot];
  const uint32_t area = area_at(*bank_, place, finger.area);
  if (area != finger.area) {
    finger.place = place;
    enter(slot, area, now_ms);
  } else if (area != kNoArea && has_stepped(finger, place)) {
    finger.place = place;
    note(AreaEvent::kStepped, slot, now_ms);
    begin(finger, bank_->area(area).hold);
  }
  finger.place = place;
  if (finger.area != kNoArea) hold(finger);
}

// What was held in the other area ends, what played once goes on.
void FingerEffects::enter(uint32_t slot, uint32_t area, uint32_t now_ms) {
  FingerEffect& finger = fingers_[slot];
  finger.area = area;
  note(AreaEvent::kEntered, slot, now_ms);
  for (EffectPlayer& player : finger.players) {
    if (player.is_held()) player.stop();
  }
  if (area == kNoArea) return;
  begin_steps(finger);
  begin(finger, bank_->area(area).enter);
}

void FingerEffects::release(uint32_t slot, bool is_heard, uint32_t now_ms) {
  FingerEffect& finger = fingers_[slot];
  note(AreaEvent::kReleased, slot, now_ms);
  for (EffectPlayer& player : finger.players) player.stop();
  const uint32_t effect = finger.area == kNoArea ? f::kNoEffect : bank_->area(finger.area).release;
  finger.phase = Phase::kAbsent;
  if (effect == f::kNoEffect || !is_heard) return;
  finger.phase = Phase::kLingering;
  finger.ends_ms = now_ms + milliseconds_of(bank_->effect(effect).lasts) + kLingerMs;
  begin(finger, effect);
}

void FingerEffects::clear(uint32_t now_ms) {
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    if (fingers_[s].phase == Phase::kDown) note(AreaEvent::kReleased, s, now_ms);
    fingers_[s] = {};
  }
}

// By time: again and again, once what the press began is over.
void FingerEffects::hold(FingerEffect& finger) {
  const BankArea area = bank_->area(finger.area);
  if (area.hold == f::kNoEffect || area.every_um > 0 || finger.is_playing()) return;
  begin(finger, area.hold, true);
}

void FingerEffects::begin_steps(FingerEffect& finger) {
  const BankArea area = bank_->area(finger.area);
  finger.travelled_um = 0.0F;
  if (area.every_um == 0 || area.along == f::kAlongPath) return;
  finger.step = floor_of(along(area, finger.place), static_cast<int32_t>(area.every_um));
}

// Steps along x or y are at fixed places, and a finger that rests on one does not play it twice.
bool FingerEffects::has_stepped(FingerEffect& finger, Place place) const {
  const BankArea area = bank_->area(finger.area);
  if (area.every_um == 0) return false;
  const auto every = static_cast<int32_t>(area.every_um);
  if (area.along == f::kAlongPath) {
    finger.travelled_um += distance_um(finger.place, place);
    const auto most = static_cast<float>(every);
    if (finger.travelled_um < most) return false;
    finger.travelled_um -= most;
    if (finger.travelled_um > most) finger.travelled_um = 0.0F;
    return true;
  }
  const int32_t at = along(area, place), slack = every / 8;
  const int32_t begins = finger.step * every;
  if (at >= begins - slack && at < begins + every + slack) return false;
  finger.step = floor_of(at, every);
  return true;
}

void FingerEffects::begin(FingerEffect& finger, uint32_t effect, bool is_held) {
  if (effect != f::kNoEffect) {
    begin(finger, effect, bank_->area(finger.area).level_q15, is_held);
  }
}

// What is held ends. Of two that play once the one that began first ends.
void FingerEffects::begin(FingerEffect& finger, uint32_t effect, uint32_t level_q15, bool is_held) {
  EffectPlayer &first = finger.players[0], &second = finger.players[1];
  if (first.is_playing() && !first.is_held()) second = first;
  first.start(bank_->effect(effect), level_q15, is_held);
}

bool FingerEffects::play(uint32_t slot, uint32_t effect, uint32_t level_q15) {
  FingerEffect& finger = fingers_[slot];
  if (!has_bank() || effect >= bank_->effects() || finger.phase != Phase::kDown) return false;
  begin(finger, effect, level_q15, false);
  return true;
}

void FingerEffects::render(uint32_t slot, SignalRing& ring) {
  FingerEffect& finger = fingers_[slot];
  if (finger.phase == Phase::kAbsent) return;
  if (finger.is_new) ring.begin();
  finger.is_new = false;
  std::array<float, kAhead> samples{};
  const uint32_t filled = ring.filled();
  const uint32_t count = filled < kAhead ? kAhead - filled : 0U;
  if (finger.is_playing()) finger.tail = kLowPassTail + kAhead;
  for (EffectPlayer& player : finger.players) player.add(samples.data(), count);
  for (uint32_t k = 0; k < count && finger.tail > 0; ++k, --finger.tail) {
    const float value = finger.low_pass.next(samples[k]);
    const float most = 32767.0F;
    const float limited = value > most ? most : value < -most ? -most : value;
    ring.push(static_cast<int16_t>(limited));
  }
  const bool is_over = !finger.is_playing() && finger.tail == 0;
  if (finger.phase == Phase::kLingering && is_over) finger = {};
}

}  // namespace chladni
