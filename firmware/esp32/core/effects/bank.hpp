// An effect bank, read where it lies in flash: areas of the board, and what fingers feel there.
//
// `load` checks all of it, so that nothing is checked while it plays.
#pragma once

#include <cstdint>

#include "core/generated/bank_format.hpp"
#include "core/generated/device_codes.hpp"
#include "core/hal.hpp"

namespace chladni {

// A tone, a click, noise or a clip; times in samples.
struct EffectPart {
  uint32_t kind;
  uint32_t begins;  // from the effect's begin
  uint32_t lasts;
  uint32_t amplitudes;   // breakpoints of its amplitude, or a clip's samples
  uint32_t frequencies;  // breakpoints of its frequency, behind those
  int32_t level_q15;     // of a click or a clip
  uint32_t rate;         // a click's frequency, a clip's samples per sample in 1/4096
  const uint8_t* data;

  uint32_t data_bytes() const {
    const uint32_t each = kind == bank_format::kPartClip ? 1U : bank_format::kPointBytes;
    return amplitudes * each + frequencies * bank_format::kPointBytes;
  }
  const uint8_t* next() const { return data + data_bytes(); }
};

EffectPart read_part(const uint8_t* bytes);

struct BankEffect {
  const uint8_t* parts = nullptr;  // the first; the others follow
  uint32_t count = 0;
  uint32_t lasts = 0;
  uint32_t loop_from = 0;
  uint32_t loop_to = 0;
};

struct BankArea {
  uint32_t shape;
  uint32_t corners;
  uint32_t along;
  uint32_t press, enter, hold, release;  // effects, or kNoEffect
  uint32_t every_um;
  uint32_t level_q15;
  uint32_t most_10nm;  // an amplitude of 1 moves a finger no further; 0: as far as it can
  const uint8_t* points;

  Place point(uint32_t k) const;
};

class Bank {
 public:
  // What lies at `base` in the bank's flash.
  BankStatus load(const Hal& hal, uint32_t base);
  void clear() { bytes_ = nullptr; }

  bool is_loaded() const { return bytes_ != nullptr; }
  const uint8_t* bytes() const { return bytes_; }
  uint32_t total_bytes() const { return total_bytes_; }
  uint32_t crc() const;
  const uint8_t* name() const { return bytes_ + bank_format::kAtName; }
  uint32_t effects() const { return effects_; }
  uint32_t areas() const { return areas_; }
  int32_t hysteresis_um() const { return hysteresis_um_; }
  // Of the numbers below `effects` and `areas`.
  BankEffect effect(uint32_t number) const;
  BankArea area(uint32_t number) const;
  const uint8_t* effect_name(uint32_t number) const {
    return effect_entry(number) + bank_format::kEffectAtName;
  }
  const uint8_t* area_name(uint32_t number) const {
    return area_entry(number) + bank_format::kAreaAtName;
  }

  // Whether a header is of a bank that may be loaded, before the rest has come.
  static BankStatus check_head(const uint8_t* header, uint32_t total_bytes);

 private:
  BankStatus check(const Hal& hal, uint32_t base);
  bool take_header(const uint8_t* header);
  bool has(const uint8_t* at, uint32_t count) const;
  bool is_area(uint32_t number) const;
  bool is_effect(uint32_t number) const;
  const uint8_t* area_entry(uint32_t number) const {
    return bytes_ + bank_format::kHeaderBytes + number * bank_format::kAreaBytes;
  }
  const uint8_t* effect_entry(uint32_t number) const {
    return area_entry(areas_) + number * bank_format::kEffectBytes;
  }

  const uint8_t* bytes_ = nullptr;
  uint32_t total_bytes_ = 0;
  uint32_t effects_ = 0;
  uint32_t areas_ = 0;
  int32_t hysteresis_um_ = 0;
};

}  // namespace chladni
