// A host's updates of what lies in slots: each is paid for in flash wear, and ends for want of
// news.
#pragma once

#include <cstdint>

#include "core/generated/link_format.hpp"
#include "core/storage/files/slot_store.hpp"
#include "core/storage/flash_wear.hpp"

namespace chladni {

link_format::Status to_link(StoreStatus status);

class SlotUpdates {
 public:
  explicit constexpr SlotUpdates(const SlotKind& kind) : largest_(kind.largest), store_(kind) {}

  // Where the file that counts begins; what was under way is given up.
  uint32_t find(const Hal& hal) {
    store_.abandon();
    return store_.find(hal);
  }

  // Whether so much may be written, before anything is erased.
  link_format::Status check_room(const FlashWear& wear, uint32_t total_bytes,
                                 uint32_t file_crc) const;
  // While nothing plays; `find` comes next, whatever `commit` and `restore_other` answer.
  link_format::Status begin(const Hal& hal, FlashWear& wear, uint32_t total_bytes,
                            uint32_t file_crc);
  link_format::Status write(const Hal& hal, uint32_t offset, const uint8_t* bytes, uint32_t count) {
    return to_link(store_.write(hal, offset, bytes, count));
  }
  template <typename Accepts>
  link_format::Status commit(const Hal& hal, FlashWear& wear, const Accepts& accepts) {
    const link_format::Status status = pay_for_entry(hal, wear);
    return status == link_format::Status::kOk ? to_link(store_.commit(hal, accepts)) : status;
  }
  template <typename Accepts>
  link_format::Status restore_other(const Hal& hal, FlashWear& wear, const Accepts& accepts) {
    if (store_.has_other(hal)) wear.spend(hal);
    return to_link(store_.restore_other(hal, accepts));
  }

  // When an update was last heard of, and whether it is over for want of news.
  void hear(uint32_t awake_ms) { heard_ms_ = awake_ms; }
  bool is_silent(uint32_t awake_ms) const {
    return awake_ms - heard_ms_ >= link_format::kUpdateSilenceMs;
  }

  const SlotStore& store() const { return store_; }

 private:
  link_format::Status pay_for_entry(const Hal& hal, FlashWear& wear);

  uint32_t largest_;
  SlotStore store_;
  bool is_paid_ = false;  // the update that is under way, or broke off
  uint32_t heard_ms_ = 0;
};

}  // namespace chladni
