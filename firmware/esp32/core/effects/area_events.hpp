// What fingers did on a bank's areas, for hosts that ask; the oldest are dropped.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"
#include "core/hal.hpp"

namespace chladni {

struct AreaRecord {
  uint32_t at_ms = 0;
  AreaEvent what = AreaEvent::kPressed;
  uint32_t slot = 0;
  uint32_t area = 0;
  Place place{};
};

class AreaEvents {
 public:
  static constexpr uint32_t kMost = 32;

  void add(const AreaRecord& record) {
    records_[end_++ % kMost] = record;
    if (end_ - begin_ > kMost) begin_ = end_ - kMost;
  }
  // Areas have other numbers from now on.
  void forget() { begin_ = end_; }
  // Numbers of those that are kept, counted from start.
  uint32_t begin() const { return begin_; }
  uint32_t end() const { return end_; }
  const AreaRecord& at(uint32_t number) const { return records_[number % kMost]; }

 private:
  std::array<AreaRecord, kMost> records_{};
  uint32_t begin_ = 0;
  uint32_t end_ = 0;
};

}  // namespace chladni
