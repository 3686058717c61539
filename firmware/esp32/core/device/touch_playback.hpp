// How touches play: where, how loud, and what the sample interrupt is told next. The interrupt
// takes one command at a time, so what is next waits here; the last one counts.
//
// A finger alone plays the table's drive for its place. Several, or one where a table has responses
// alone, play drives that are found from those (finger_drives.hpp): each finger has a voice of its
// own, and all change over together.
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/finger_drives.hpp"
#include "core/generated/config_format.hpp"
#include "core/hal.hpp"
#include "core/limits/coil_heat.hpp"
#include "core/synthesis/envelope.hpp"
#include "core/synthesis/synthesis.hpp"
#include "core/table/table.hpp"
#include "core/touch/contacts.hpp"

namespace chladni {

// A finger has one slot everywhere.
static_assert(kMaxFingers == kMaxVoices && kMostListed == fingers::kMostFingers);

// What a finger plays, by slot.
struct VoiceSettings {
  uint32_t frequency_millihertz = 0;  // 0: the table's
  uint32_t level_q15 = 32767;         // of the configured one; 0: it feels, and is not heard
  bool has_signal = false;            // what is pushed for it, in place of the configured wave
  uint32_t most_10nm = 0;             // a signal moves it no further; 0: as far as it can

  // No host has asked for anything.
  bool are_own() const { return frequency_millihertz == 0 && level_q15 == 32767 && !has_signal; }
};

class TouchPlayback {
 public:
  // Only while nothing plays.
  void start(const Config& config, uint32_t table_ramp_us, bool has_bank);

  // The first fingers come down.
  void begin(const Touches& touches, uint32_t now_us);
  // Each turn in which there are any: others come and leave, and all move if they may.
  void follow(const Touches& touches, const Table& table, bool may_move, uint32_t now_us);
  // The same of fingers that have no voice, wherever they move.
  void spare(const Bystanders& bystanders, const Table& table);
  // How far effects of the bank may move a finger from now on, 0.01 µm; 0: as far as they can.
  void limit(uint32_t slot, uint32_t most_10nm) {
    if (fingers_[slot].most_10nm == most_10nm) return;
    fingers_[slot].most_10nm = most_10nm;
    change();
  }
  // The last finger has left, and its lift pulse plays.
  void lift(uint32_t now_us);
  bool has_lift_pulse() const { return envelope_.lift_pulse_us() > 0; }
  bool is_lift_over(uint32_t now_us) const {
    return now_us - lifted_us_ >= envelope_.lift_pulse_us();
  }
  // The same: from attacks to decays, and drives that are found in the meantime.
  void advance(const Table& table, uint32_t now_us);
  // Outputs fade out, whoever plays.
  void fade_out() { next_ = Next::kFade; }
  // The same, in the table's ramp however long a release is; if they are off already, nothing is
  // next.
  void stop(const Synthesis& synthesis) {
    next_ = synthesis.is_quiet() ? Next::kNothing : Next::kStop;
  }

  // What the interrupt was not told yet: a start, or to fade out.
  bool is_starting() const { return next_ == Next::kStart; }
  bool is_fading() const { return next_ == Next::kFade || next_ == Next::kStop; }

  // Tells it what is next, if it has room. True once that has started a touch.
  bool post(Synthesis& synthesis, const Table& table, const Config& config, const CoilHeat& heat,
            uint32_t now_us);

  // From a finger's next touch on.
  void set_voice(uint32_t slot, const VoiceSettings& settings) { wanted_[slot] = settings; }
  void limit_signal(uint32_t slot, uint32_t most_10nm) { wanted_[slot].most_10nm = most_10nm; }
  // Whether a finger plays effects of the bank: if there is one, and no host asked for a tone or a
  // signal of its own.
  bool plays_bank(uint32_t slot) const {
    return fingers_[slot].is_there && fingers_[slot].plays_bank;
  }
  uint32_t bank_fingers() const;
  const FingerDrives& drives() const { return drives_; }

 private:
  enum class Next : uint8_t {
    kNothing,
    kChange,  // to another drive of the same touch
    kStart,   // of a touch
    kFade,    // in the release's time
    kStop,    // at once
  };

  struct FingerVoice {
    bool is_there = false;
    bool has_begun = false;  // the interrupt knows of it
    bool plays_bank = false;
    uint32_t most_10nm = 0;
    Place place{};
    Place asked_place{};  // for which drives were asked
    Envelope envelope;
    VoiceSettings settings;
  };

  // A finger that moves so little keeps its drives, in each direction: a sixteenth of a pitch of
  // 8 mm. They are asked for again after so long at the soonest.
  static constexpr int32_t kStillUm = 500;
  static constexpr uint32_t kSolveUs = 2000;
  // The turn in which drives are asked for again: fingers came, left or moved.
  enum class Ask : uint8_t { kNo, kSoon, kNow };

  // To another place or line; a start that the interrupt was not told yet stays one.
  void change() {
    if (next_ != Next::kStart) next_ = Next::kChange;
  }
  void come(uint32_t slot, Place place, uint32_t now_us);
  void move(FingerVoice& finger, Place place, const Table& table);
  uint32_t there() const;
  bool is_alone_with(const Table& table) const;
  void ask_drives(const Table& table, uint32_t now_us);
  Line common_line(uint32_t now_us) const;
  bool are_all_ready(const Table& table) const;
  void begin_envelopes(const Table& table, uint32_t now_us);
  bool has_drive(uint32_t slot, const Table& table) const;
  Drive drive_of(uint32_t slot, const Table& table) const;
  bool play(Synthesis& synthesis, const Table& table, const Config& config, const CoilHeat& heat,
            uint32_t now_us);
  uint32_t limited_level(uint32_t slot, uint32_t level_q15, const Drive& drive, const Table& table,
                         const Config& config) const;
  bool brings_bias(const Config& config, const Table& table) const;
  bool play_voices(Synthesis& synthesis, const Table& table, const Config& config,
                   const CoilHeat& heat, uint32_t now_us);

  Envelope envelope_;       // as configured
  Envelope flat_envelope_;  // of effects, which have shapes of their own
  bool has_bank_ = false;
  Next next_ = Next::kNothing;
  Ask ask_ = Ask::kNo;
  bool is_lifted_ = false;
  uint32_t lifted_us_ = 0;
  uint32_t asked_us_ = 0;
  // When the line that all are on ends, if one of them goes on.
  bool goes_on_ = false;
  uint32_t line_end_us_ = 0;
  std::array<FingerVoice, kMaxFingers> fingers_{};
  std::array<VoiceSettings, kMaxFingers> wanted_{};
  Bystanders bystanders_{};
  FingerDrives drives_;
};

}  // namespace chladni
