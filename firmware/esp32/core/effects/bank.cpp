#include "core/effects/bank.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"

namespace chladni {

namespace {

namespace f = bank_format;

bool in_range(uint32_t value, uint32_t low, uint32_t high) { return value >= low && value <= high; }

bool is_named(const uint8_t* name) { return name[0] != 0 && is_name(name, f::kNameBytes); }

bool is_place(Place place) {
  const auto most = static_cast<int32_t>(f::kMaxPlaceUm);
  return place.x_um >= -most && place.x_um <= most && place.y_um >= -most && place.y_um <= most;
}

// Breakpoints in order, and their values within range.
bool are_points(const uint8_t* points, uint32_t count, uint32_t lasts, uint32_t low,
                uint32_t high) {
  uint32_t before = 0;
  for (uint32_t k = 0; k < count; ++k, points += f::kPointBytes) {
    const uint32_t at = read_u16(points + f::kPointAtAt);
    if (at < before || at > lasts) return false;
    if (!in_range(read_u16(points + f::kPointAtValue), low, high)) return false;
    before = at;
  }
  return true;
}

bool is_part(const EffectPart& part, uint32_t effect_lasts) {
  if (part.lasts == 0 || part.begins + part.lasts > effect_lasts) return false;
  if (part.level_q15 > static_cast<int32_t>(f::kFullScale)) return false;
  const bool has_curve = part.amplitudes > 0 && part.level_q15 == 0 && part.rate == 0 &&
                         are_points(part.data, part.amplitudes, part.lasts, 0, f::kFullScale);
  switch (part.kind) {
    case f::kPartTone:
      return has_curve && part.frequencies > 0 &&
             are_points(part.data + part.amplitudes * f::kPointBytes, part.frequencies, part.lasts,
                        1, f::kMaxFrequency);
    case f::kPartClick:
      return part.amplitudes == 0 && part.frequencies == 0 &&
             in_range(part.rate, 1, f::kMaxFrequency);
    case f::kPartNoise: return has_curve && part.frequencies == 0;
    case f::kPartClip:
      return part.frequencies == 0 && in_range(part.rate, 1, f::kMaxClipStep) &&
             (part.lasts - 1U) * part.rate / f::kClipSteps < part.amplitudes;
    default: return false;
  }
}

BankStatus check_kind(const uint8_t* header) {
  if (read_u32(header + f::kAtMagic) != f::kMagic) return BankStatus::kBadMagic;
  const bool is_known = header[f::kAtVersionMajor] == f::kVersionMajor &&
                        header[f::kAtVersionMinor] <= f::kVersionMinor;
  return is_known ? BankStatus::kOk : BankStatus::kBadVersion;
}

}  // namespace

EffectPart read_part(const uint8_t* bytes) {
  return {bytes[f::kPartAtKind],
          read_u16(bytes + f::kPartAtBegins),
          read_u16(bytes + f::kPartAtLasts),
          read_u16(bytes + f::kPartAtAmplitudes),
          read_u16(bytes + f::kPartAtFrequencies),
          static_cast<int32_t>(read_u16(bytes + f::kPartAtLevelQ15)),
          read_u16(bytes + f::kPartAtRate),
          bytes + f::kPartBytes};
}

Place BankArea::point(uint32_t k) const {
  const uint8_t* const at = points + k * f::kCornerBytes;
  return {static_cast<int32_t>(read_u32(at + f::kCornerAtXUm)),
          static_cast<int32_t>(read_u32(at + f::kCornerAtYUm))};
}

BankStatus Bank::load(const Hal& hal, uint32_t base) {
  const BankStatus status = check(hal, base);
  if (status != BankStatus::kOk) clear();
  return status;
}

BankStatus Bank::check_head(const uint8_t* header, uint32_t total_bytes) {
  const BankStatus kind = check_kind(header);
  if (kind != BankStatus::kOk) return kind;
  const uint32_t total = read_u32(header + f::kAtTotalBytes);
  if (total != total_bytes || !in_range(total, f::kSmallestFile, f::kLargestFile)) {
    return BankStatus::kBadSize;
  }
  const uint32_t directories = f::kHeaderBytes + header[f::kAtAreas] * f::kAreaBytes +
                               header[f::kAtEffects] * f::kEffectBytes;
  if (directories > total - f::kCrcBytes) return BankStatus::kBadSize;
  Bank found;
  return found.take_header(header) ? BankStatus::kOk : BankStatus::kBadField;
}

BankStatus Bank::check(const Hal& hal, uint32_t base) {
  const auto map = [&](uint32_t count) {
    return hal.map_flash(hal.context, FlashArea::kEffects, base, count);
  };
  const uint8_t* const header = map(f::kHeaderBytes);
  if (header == nullptr) return BankStatus::kNone;
  bool is_blank = true;
  for (uint32_t k = 0; k < f::kHeaderBytes; ++k) is_blank = is_blank && header[k] == 0xFF;
  if (is_blank) return BankStatus::kNone;
  const BankStatus kind = check_kind(header);
  if (kind != BankStatus::kOk) return kind;
  total_bytes_ = read_u32(header + f::kAtTotalBytes);
  if (check_head(header, total_bytes_) == BankStatus::kBadSize) return BankStatus::kBadSize;
  bytes_ = map(total_bytes_);
  if (bytes_ == nullptr) return BankStatus::kBadSize;
  if (crc32(bytes_, total_bytes_ - f::kCrcBytes) != crc()) return BankStatus::kBadCrc;
  if (!take_header(bytes_)) return BankStatus::kBadField;
  for (uint32_t k = 0; k < areas_; ++k) {
    if (!is_area(k)) return BankStatus::kBadArea;
  }
  for (uint32_t k = 0; k < effects_; ++k) {
    if (!is_effect(k)) return BankStatus::kBadEffect;
  }
  return BankStatus::kOk;
}

uint32_t Bank::crc() const { return read_u32(bytes_ + total_bytes_ - f::kCrcBytes); }

bool Bank::take_header(const uint8_t* header) {
  effects_ = header[f::kAtEffects];
  areas_ = header[f::kAtAreas];
  const uint32_t hysteresis_um = read_u16(header + f::kAtHysteresisUm);
  hysteresis_um_ = static_cast<int32_t>(hysteresis_um);
  return effects_ <= f::kMaxEffects && areas_ <= f::kMaxAreas &&
         hysteresis_um <= f::kMaxHysteresisUm && read_u16(header + f::kAtReserved) == 0 &&
         is_named(header + f::kAtName);
}

// Whether bytes lie between the directories and the CRC.
bool Bank::has(const uint8_t* at, uint32_t count) const {
  const uint8_t* const end = bytes_ + total_bytes_ - f::kCrcBytes;
  return at >= effect_entry(effects_) && at <= end && count <= static_cast<uint32_t>(end - at);
}

BankArea Bank::area(uint32_t number) const {
  const uint8_t* const e = area_entry(number);
  return {e[f::kAreaAtShape],
          e[f::kAreaAtCorners],
          e[f::kAreaAtAlong],
          e[f::kAreaAtPress],
          e[f::kAreaAtEnter],
          e[f::kAreaAtHold],
          e[f::kAreaAtRelease],
          read_u32(e + f::kAreaAtEveryUm),
          read_u16(e + f::kAreaAtLevelQ15),
          read_u16(e + f::kAreaAtMost10nm),
          bytes_ + read_u32(e + f::kAreaAtOffset)};
}

bool Bank::is_area(uint32_t number) const {
  const uint8_t* const entry = area_entry(number);
  if (!is_named(area_name(number)) || read_u32(entry + f::kAreaAtOffset) > total_bytes_)
    return false;
  const BankArea area = this->area(number);
  const auto has_effect = [this](uint32_t e) { return e == f::kNoEffect || e < effects_; };
  const bool is_fine = area.along <= f::kAlongY && entry[f::kAreaAtReserved] == 0 &&
                       has_effect(area.press) && has_effect(area.enter) && has_effect(area.hold) &&
                       has_effect(area.release) && area.every_um <= f::kMaxEveryUm &&
                       area.level_q15 <= f::kFullScale && area.corners <= f::kMaxCorners &&
                       has(area.points, area.corners * f::kCornerBytes);
  if (!is_fine) return false;
  for (uint32_t k = 0; k < area.corners; ++k) {
    if (!is_place(area.point(k))) return false;
  }
  switch (area.shape) {
    case f::kShapeEverywhere: return area.corners == 0 && number + 1U == areas_;
    case f::kShapeCircle:
      return area.corners == 2 && area.point(1).x_um >= 1 && area.point(1).y_um == 0;
    case f::kShapePolygon: return area.corners >= 3;
    default: return false;
  }
}

BankEffect Bank::effect(uint32_t number) const {
  const uint8_t* const e = effect_entry(number);
  return {bytes_ + read_u32(e + f::kEffectAtOffset), e[f::kEffectAtParts],
          read_u16(e + f::kEffectAtLasts), read_u16(e + f::kEffectAtLoopFrom),
          read_u16(e + f::kEffectAtLoopTo)};
}

bool Bank::is_effect(uint32_t number) const {
  const uint8_t* const entry = effect_entry(number);
  if (!is_named(effect_name(number)) || read_u32(entry + f::kEffectAtOffset) > total_bytes_)
    return false;
  const BankEffect effect = this->effect(number);
  if (effect.count == 0 || entry[f::kEffectAtReserved] != 0 || effect.loop_from >= effect.loop_to ||
      effect.loop_to > effect.lasts) {
    return false;
  }
  const uint8_t* at = effect.parts;
  uint32_t tones = 0;
  for (uint32_t k = 0; k < effect.count; ++k) {
    if (!has(at, f::kPartBytes) || at[f::kPartAtReserved] != 0) return false;
    const EffectPart part = read_part(at);
    if (!has(part.data, part.data_bytes()) || !is_part(part, effect.lasts)) return false;
    tones += part.kind == f::kPartTone ? 1U : 0U;
    at = part.next();
  }
  return tones <= f::kMaxTones;
}

}  // namespace chladni
