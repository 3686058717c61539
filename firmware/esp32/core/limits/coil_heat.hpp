// How warm the coils are, from what their pins got.
//
// A coil is one thermal resistance and one time constant: its rise above the air moves towards
// (mean square of the duty) * (rise at a duty of 1). At a few hundred hertz a coil's inductance
// changes its current by less than a tenth, and leaving it out errs to the safe side.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/config_format.hpp"
#include "core/storage/retained.hpp"
#include "core/synthesis/drive.hpp"

namespace chladni {

class CoilHeat {
 public:
  // How warm they were when it was last counted. A coil that no one knows of is as warm as it may
  // be; if it might have been warmer since the limit was raised, it was. Known rises are never cut,
  // whatever the limit has become. `were_on`: more has come since.
  void start(const Config& config, PinHeat& known, bool were_on);
  // The longest that outputs may go on unwatched: a main loop that hangs, and the ramp after it.
  // Coils must not pass their limit in that time either.
  void set_reaction(uint32_t milliseconds);
  // What the pins got in the last milliseconds. Whether that was counted: it is once in so many.
  bool add(const Squares& squares, uint32_t milliseconds);
  // To the pins that are in use; what is known of others stays.
  void note(const Config& config, PinHeat& known) const;

  // Rise above the air, 0.1 K.
  uint32_t rise_dk(uint32_t channel) const {
    return static_cast<uint32_t>(rise_uk_[channel]) / 100000U;
  }
  // The first channel that could pass its limit before outputs are off, or kMaxChannels.
  uint32_t hot_channel() const;
  // Whether all have cooled to seven eighths of what makes them hot.
  bool has_cooled() const;
  // Lowers the gains of cooler coils by as much as the warmest loses to its resistance, so that the
  // forces keep the proportions of the drive. No gain grows.
  void even_out(Drive& drive) const;

 private:
  // Means are taken over so long: ten waves at 160 Hz, and one at 20 Hz.
  static constexpr uint32_t kWindowMs = 64;

  // How much further it may rise before outputs are off.
  int32_t lead_uk(uint32_t channel, uint32_t reaction_ms) const;

  uint32_t channels_ = 0;
  std::array<uint16_t, kMaxChannels> full_rise_dk_{};
  int32_t limit_uk_ = 0;
  std::array<int32_t, kMaxChannels> hot_uk_{};  // from there on the limit might be passed
  bool were_on_ = false;
  uint32_t max_square_q15_ = 32768;
  int32_t heating_ms_ = 1;
  std::array<int32_t, kMaxChannels> rise_uk_{};  // microkelvin
  uint32_t window_ms_ = 0;
  Squares sums_{};
};

}  // namespace chladni
