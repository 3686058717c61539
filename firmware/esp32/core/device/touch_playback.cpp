#include "core/device/touch_playback.hpp"

#include "core/fingers/real_part.hpp"
#include "core/storage/config.hpp"
#include "core/table/coil_gains.hpp"

namespace chladni {

namespace {

bool is_same(Place one, Place other) { return one.x_um == other.x_um && one.y_um == other.y_um; }

bool are_several(uint32_t slots) { return (slots & (slots - 1U)) != 0; }

// Older records have a 0.
uint32_t bias_ramp_us(const Config& config) {
  const uint32_t own_ms = config.bias_ramp_ms;
  return (own_ms > 0 ? own_ms : Config{}.bias_ramp_ms) * 1000U;
}

bool is_near(Place one, Place other, int32_t um) {
  const int32_t x = one.x_um - other.x_um, y = one.y_um - other.y_um;
  return x >= -um && x <= um && y >= -um && y <= um;
}

}  // namespace

void TouchPlayback::start(const Config& config, uint32_t table_ramp_us, bool has_bank) {
  has_bank_ = has_bank;
  envelope_.start(config, table_ramp_us);
  Config flat = config;
  flat.attack_ms = flat.decay_ms = 0;
  flat.sustain_q15 = 32767;
  flat_envelope_.start(flat, table_ramp_us);
  drives_.start(config.channels);
  next_ = Next::kNothing;
}

void TouchPlayback::come(uint32_t slot, Place place, uint32_t now_us) {
  const bool plays_bank = has_bank_ && wanted_[slot].are_own();
  const Envelope& envelope = plays_bank ? flat_envelope_ : envelope_;
  fingers_[slot] = {true, false, plays_bank, 0, place, place, envelope, wanted_[slot]};
  if (plays_bank) fingers_[slot].settings.has_signal = true;
  fingers_[slot].envelope.begin(now_us);
  drives_.forget(slot);
  ask_ = Ask::kNow;
}

void TouchPlayback::begin(const Touches& touches, uint32_t now_us) {
  is_lifted_ = false;
  bystanders_ = {};
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    fingers_[s] = {};
    if (touches[s].is_down) come(s, touches[s].place, now_us);
  }
  next_ = Next::kStart;
}

void TouchPlayback::move(FingerVoice& finger, Place place, const Table& table) {
  if (is_same(place, finger.place)) return;
  finger.place = place;
  if (ask_ == Ask::kNo && !is_near(place, finger.asked_place, kStillUm)) ask_ = Ask::kSoon;
  if (is_alone_with(table)) change();
}

// Where none is left, the touch is about to end: by an event of its own. Who comes is heard once
// there are drives for all.
void TouchPlayback::follow(const Touches& touches, const Table& table, bool may_move,
                           uint32_t now_us) {
  if (count_of(touches) == 0) return;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    FingerVoice& finger = fingers_[s];
    if (touches[s].is_down && !finger.is_there) {
      come(s, touches[s].place, now_us);
    } else if (!touches[s].is_down && finger.is_there) {
      finger.is_there = false;
      ask_ = Ask::kNow;
      change();
    } else if (finger.is_there && may_move) {
      move(finger, touches[s].place, table);
    }
  }
}

void TouchPlayback::spare(const Bystanders& bystanders, const Table& table) {
  bool is_other = bystanders.count != bystanders_.count;
  for (uint32_t k = 0; k < bystanders.count && !is_other; ++k) {
    is_other = !is_near(bystanders.places[k], bystanders_.places[k], kStillUm);
  }
  if (!is_other) return;
  bystanders_ = bystanders;
  if (ask_ == Ask::kNo) ask_ = Ask::kSoon;
  if (is_alone_with(table)) change();
}

void TouchPlayback::lift(uint32_t now_us) {
  is_lifted_ = true;
  lifted_us_ = now_us;
  change();
}

void TouchPlayback::advance(const Table& table, uint32_t now_us) {
  ask_drives(table, now_us);
  if (drives_.work(table)) change();
  if (is_starting()) return;
  for (FingerVoice& finger : fingers_) {
    if (finger.is_there && finger.envelope.decays(now_us)) change();
  }
  if (goes_on_ && static_cast<int32_t>(now_us - line_end_us_) >= 0) change();
}

uint32_t TouchPlayback::there() const {
  uint32_t found = 0;
  for (uint32_t s = 0; s < kMaxFingers; ++s) found |= (fingers_[s].is_there ? 1U : 0U) << s;
  return found;
}

uint32_t TouchPlayback::bank_fingers() const {
  uint32_t found = 0;
  for (uint32_t s = 0; s < kMaxFingers; ++s) found |= (plays_bank(s) ? 1U : 0U) << s;
  return found;
}

bool TouchPlayback::is_alone_with(const Table& table) const {
  const uint32_t slots = there();
  const bool is_alone = slots != 0 && !are_several(slots) && bystanders_.count == 0;
  return is_alone && table.has_drives();
}

// A finger that came or left is worth beginning again for, a move is not.
void TouchPlayback::ask_drives(const Table& table, uint32_t now_us) {
  if (ask_ == Ask::kNo || !table.has_responses()) return;
  if (is_alone_with(table)) {
    ask_ = Ask::kNo;
    drives_.stop();
    return;
  }
  const bool is_time = !drives_.is_busy() && now_us - asked_us_ >= kSolveUs;
  if (ask_ == Ask::kSoon && !is_time) return;
  ask_ = Ask::kNo;
  asked_us_ = now_us;
  FingerDrives::Places places{};
  uint32_t silent = 0, real = 0;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    FingerVoice& finger = fingers_[s];
    places[s] = finger.asked_place = finger.place;
    if (finger.settings.level_q15 == 0) silent |= 1U << s;
    if (finger.settings.has_signal) real |= 1U << s;
  }
  uint32_t everyone = there();
  for (uint32_t k = 0; k < bystanders_.count; ++k) {
    const uint32_t beyond = kMaxFingers + k;
    if (beyond == places.size()) break;
    places[beyond] = bystanders_.places[k];
    everyone |= 1U << beyond;
    silent |= 1U << beyond;
  }
  drives_.ask({everyone, silent, real}, places);
}

// The shortest line of any: then all are on their way, and none is passed over.
Line TouchPlayback::common_line(uint32_t now_us) const {
  if (is_lifted_) return envelope_.lift_line();
  Line shortest{0, 0xFFFFFFFFU};
  for (const FingerVoice& finger : fingers_) {
    if (!finger.is_there || (!finger.has_begun && !is_starting())) continue;
    const Line line = finger.envelope.current(now_us);
    if (line.ramp_us < shortest.ramp_us) shortest = line;
  }
  return shortest;
}

// False while its drive is being looked for.
bool TouchPlayback::has_drive(uint32_t slot, const Table& table) const {
  return is_alone_with(table) || (drives_.solved() >> slot & 1U) != 0;
}

Drive TouchPlayback::drive_of(uint32_t slot, const Table& table) const {
  if (!is_alone_with(table)) return drives_.drive(slot);
  Drive drive{};
  table.drive_at(fingers_[slot].place, drive);
  if (fingers_[slot].settings.has_signal) keep_real_part(drive);
  return drive;
}

// Who plays goes on as it is until there are new drives for all of them, and nothing starts
// without.
bool TouchPlayback::are_all_ready(const Table& table) const {
  bool is_any = false;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    if (!fingers_[s].is_there) continue;
    const bool is_ready = has_drive(s, table);
    if (!is_ready && fingers_[s].has_begun) return false;
    is_any = is_any || is_ready;
  }
  return is_any;
}

// Of those that are heard from now on.
void TouchPlayback::begin_envelopes(const Table& table, uint32_t now_us) {
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    FingerVoice& finger = fingers_[s];
    if (!finger.is_there || finger.has_begun || !has_drive(s, table)) continue;
    finger.envelope.begin(now_us);
  }
}

// A signal begins under one finger while others rest: a switch's bias, which no drive keeps from
// them, comes up so slowly that they do not feel it, and the signal waits for it.
bool TouchPlayback::brings_bias(const Config& config, const Table& table) const {
  if (config.driver == kBridge || !are_several(there())) return false;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    const FingerVoice& finger = fingers_[s];
    const bool begins = finger.is_there && !finger.has_begun && has_drive(s, table);
    if (begins && finger.settings.has_signal && finger.settings.level_q15 > 0) return true;
  }
  return false;
}

// Where it is known how far a finger is moved at full level: no further than its area allows, or
// the host of its signal.
uint32_t TouchPlayback::limited_level(uint32_t slot, uint32_t level_q15, const Drive& drive,
                                      const Table& table, const Config& config) const {
  const FingerVoice& finger = fingers_[slot];
  const uint32_t most_10nm = finger.plays_bank ? finger.most_10nm : finger.settings.most_10nm;
  if (most_10nm == 0) return level_q15;
  const FingerDrives::Reach reach{most_10nm, config.full_force_mn};
  return is_alone_with(table) ? drives_.level_within(reach, level_q15, drive, finger.place, table)
                              : drives_.level_within(reach, level_q15, slot);
}

bool TouchPlayback::post(Synthesis& synthesis, const Table& table, const Config& config,
                         const CoilHeat& heat, uint32_t now_us) {
  if (next_ == Next::kNothing) return false;
  if (next_ == Next::kStop) {
    synthesis.stop();
    next_ = Next::kNothing;
    return false;
  }
  if (next_ == Next::kFade) {
    if (synthesis.release(envelope_.release_us())) next_ = Next::kNothing;
    return false;
  }
  const bool is_start = is_starting();
  const bool has_voices = table.has_responses() || fingers_[0].settings.has_signal;
  const bool is_told = has_voices ? play_voices(synthesis, table, config, heat, now_us)
                                  : play(synthesis, table, config, heat, now_us);
  if (!is_told) return false;
  next_ = Next::kNothing;
  return is_start;
}

bool TouchPlayback::play(Synthesis& synthesis, const Table& table, const Config& config,
                         const CoilHeat& heat, uint32_t now_us) {
  Drive drive{};
  table.drive_at(fingers_[0].place, drive);
  apply_coil_gains(config, drive);
  heat.even_out(drive);
  const Line line = common_line(now_us);
  goes_on_ = false;
  if (!synthesis.play(drive, {line.level_q15, line.ramp_us, is_starting()})) return false;
  fingers_[0].has_begun = true;
  return true;
}

bool TouchPlayback::play_voices(Synthesis& synthesis, const Table& table, const Config& config,
                                const CoilHeat& heat, uint32_t now_us) {
  Voices voices{};
  if (!are_all_ready(table)) return false;
  begin_envelopes(table, now_us);
  const Line common = common_line(now_us);
  const bool is_smooth = brings_bias(config, table);
  const uint32_t ramp_us = is_smooth ? bias_ramp_us(config) : common.ramp_us;
  const uint32_t end_us = now_us + ramp_us;
  uint32_t begun = 0;
  goes_on_ = false;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    const FingerVoice& finger = fingers_[s];
    Voice& voice = voices[s];
    if (!finger.is_there || !has_drive(s, table)) continue;
    voice.drive = drive_of(s, table);
    const uint32_t level = is_lifted_ ? common.level_q15 : finger.envelope.level_at(end_us);
    const uint32_t wanted = share_q15(level, finger.settings.level_q15);
    voice.level_q15 = limited_level(s, wanted, voice.drive, table, config);
    apply_coil_gains(config, voice.drive);
    heat.even_out(voice.drive);
    voice.starts = !finger.has_begun;
    voice.has_signal = finger.settings.has_signal;
    const uint32_t own = finger.settings.frequency_millihertz;
    voice.frequency_millihertz = own > 0 ? own : table.frequency_millihertz();
    begun |= 1U << s;
    goes_on_ = goes_on_ || (!is_lifted_ && finger.envelope.is_on_a_line(end_us));
  }
  line_end_us_ = end_us;
  if (!synthesis.play_voices(voices, {32767, ramp_us, is_starting(), is_smooth})) return false;
  for (uint32_t s = 0; s < kMaxFingers; ++s) {
    if ((begun >> s & 1U) != 0) fingers_[s].has_begun = true;
  }
  return true;
}

}  // namespace chladni
