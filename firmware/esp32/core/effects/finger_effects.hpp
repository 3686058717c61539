// What each finger feels of an effect bank: by the area that it is in, and by what it does there.
//
// Runs in the main loop: effects become samples a few milliseconds before the interrupt needs them.
#pragma once

#include <array>
#include <cstdint>

#include "core/effects/area_events.hpp"
#include "core/effects/areas.hpp"
#include "core/effects/bank.hpp"
#include "core/effects/effect_player.hpp"
#include "core/effects/low_pass.hpp"
#include "core/synthesis/rings/signal_ring.hpp"
#include "core/touch/contacts.hpp"

namespace chladni {

class FingerEffects {
 public:
  // Of a bank that stays where it is until the next start; one that is not loaded plays nothing.
  void start(const Bank& bank);
  bool has_bank() const { return bank_ != nullptr && bank_->is_loaded(); }

  // Each turn of a touch. Fingers whose release still plays stay among those that are down;
  // `heard`, a bit each, has those that play the bank and nothing of a host's.
  Touches follow(const Touches& touches, uint32_t heard, uint32_t now_ms);
  // Whether any finger has left whose release still plays, or did a moment ago.
  bool are_lingering() const;
  // An effect by its number, once, for a finger that is down.
  bool play(uint32_t slot, uint32_t effect, uint32_t level_q15);
  // The touch is over, however it ended.
  void clear(uint32_t now_ms);

  // As many samples as a finger's ring should have in advance.
  void render(uint32_t slot, SignalRing& ring);

  const AreaEvents& events() const { return events_; }
  uint32_t area_of(uint32_t slot) const {
    return fingers_[slot].phase == Phase::kDown ? fingers_[slot].area : kNoArea;
  }
  // How far effects may move a finger, by its area; 0: as far as they can.
  uint32_t most_10nm(uint32_t slot) const {
    const uint32_t area = fingers_[slot].area;
    return has_bank() && area != kNoArea ? bank_->area(area).most_10nm : 0U;
  }

 private:
  // 4.9 ms: more than a turn takes, and as much later comes what follows another effect.
  static constexpr uint32_t kAhead = 12;
  // A release ends so long after its effect at the latest, also where no one takes its samples.
  static constexpr uint32_t kLingerMs = 200;

  enum class Phase : uint8_t { kAbsent, kDown, kLingering };

  struct FingerEffect {
    Phase phase = Phase::kAbsent;
    bool is_new = false;  // what its ring holds is from before
    Place place{};
    uint32_t area = kNoArea;
    float travelled_um = 0.0F;  // since its last step
    int32_t step = 0;           // number of the step that it is in, along x or y
    uint32_t tail = 0;          // samples until the low-pass and the ring are at rest
    uint32_t ends_ms = 0;       // of a release, at the latest
    // Two may overlap: one that begins does not end the one before. The first began last.
    std::array<EffectPlayer, 2> players;
    LowPass low_pass;

    bool is_playing() const { return players[0].is_playing() || players[1].is_playing(); }
  };

  void press(uint32_t slot, Place place, uint32_t now_ms);
  void move(uint32_t slot, Place place, uint32_t now_ms);
  void release(uint32_t slot, bool is_heard, uint32_t now_ms);
  void enter(uint32_t slot, uint32_t area, uint32_t now_ms);
  void hold(FingerEffect& finger);
  bool has_stepped(FingerEffect& finger, Place place) const;
  void begin(FingerEffect& finger, uint32_t effect, uint32_t level_q15, bool is_held);
  void begin(FingerEffect& finger, uint32_t effect, bool is_held = false);
  void begin_steps(FingerEffect& finger);
  void note(AreaEvent what, uint32_t slot, uint32_t now_ms);

  const Bank* bank_ = nullptr;
  std::array<FingerEffect, kMaxFingers> fingers_{};
  AreaEvents events_;
};

}  // namespace chladni
