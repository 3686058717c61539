// The drives of the fingers that are there, from a table's responses. The work is shared out over
// turns of the main loop, of which none gets more than a millisecond of it.
#pragma once

#include <array>
#include <cstdint>

#include "core/fingers/drive_solver.hpp"
#include "core/synthesis/drive.hpp"
#include "core/table/table.hpp"

namespace chladni {

class FingerDrives {
 public:
  // Fingers by slot.
  using Places = std::array<Place, fingers::kMostFingers>;

  // A bit each: fingers that are there, those that feel and are not heard, and those whose signal
  // is no tone, which get real gains.
  struct Slots {
    uint32_t there = 0;
    uint32_t silent = 0;
    uint32_t real = 0;
  };

  void start(uint32_t channels);
  // They are there now: whatever was being worked at begins again.
  void ask(const Slots& slots, const Places& places);
  // None are wanted.
  void stop();
  // Another finger takes the slot.
  void forget(uint32_t slot) { solved_ &= ~(1U << slot); }
  // One turn's share of the work; true when the drives are new.
  bool work(const Table& table);
  bool is_busy() const { return stage_ != Stage::kDone; }

  // As of the last drives: the slots that have one.
  uint32_t solved() const { return solved_; }
  const Drive& drive(uint32_t slot) const { return drives_[slot]; }
  // A finger's own displacement over the largest that its signal makes under another's, in
  // 1/kIsolationSteps; 0 alone or silent.
  uint32_t isolation(uint32_t slot) const { return isolations_[slot]; }
  // How far a finger may be moved, 0.01 µm, and what its largest coil gives at a level of 32767.
  struct Reach {
    uint32_t most_10nm;
    uint32_t full_force_mn;
  };
  // The level, or what moves the finger so far by its own drive.
  uint32_t level_within(const Reach& reach, uint32_t level_q15, uint32_t slot) const;
  // The same by a drive that was not found here, for a finger alone. Where a table does not say how
  // far that moves it, the level.
  uint32_t level_within(const Reach& reach, uint32_t level_q15, const Drive& drive, Place middle,
                        const Table& table) const;
  // In thousandths of what the coils could do for this finger alone.
  uint32_t of_loudest(uint32_t slot) const { return of_loudest_[slot]; }

 private:
  enum class Stage : uint8_t { kFill, kSolve, kDone };

  // What a turn may multiply, at less than five instructions each: less than a millisecond of an
  // ESP32, at one a cycle. Two fingers on sixteen coils need one turn.
  static constexpr uint32_t kProductsOfATurn = 45000;
  // Looking up a finger's responses takes the instructions of so many.
  uint32_t products_of_lookups() const { return 320 + 160 * channels_; }

  bool step(const Table& table);
  bool fill(const Table& table);
  void begin(const Table& table);
  void take();
  void take_one(uint32_t finger, uint32_t slot);
  float own_m_per_n(const Drive& drive, Place middle, const Table& table) const;

  fingers::DriveSolver<float> solver_;
  Stage stage_ = Stage::kDone;
  uint32_t channels_ = 1;
  Slots asked_{};
  Places places_{};
  // Slots of the solver's fingers.
  std::array<uint8_t, fingers::kMostFingers> slots_{};
  uint32_t filled_ = 0;
  uint32_t solved_ = 0;
  std::array<Drive, fingers::kMostFingers> drives_{};
  std::array<uint16_t, fingers::kMostFingers> isolations_{};
  std::array<uint16_t, fingers::kMostFingers> of_loudest_{};
  // By how much a finger's own drive moves it, per newton of the largest coil.
  std::array<float, fingers::kMostFingers> own_m_per_n_{};
};

}  // namespace chladni
