// What went wrong, when: the last sixteen faults, and which of them still stand.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"

namespace chladni {

struct Fault {
  FaultCause cause;
  uint32_t detail;
  uint32_t at_ms;  // since start
};

class FaultLog {
 public:
  static constexpr uint32_t kKept = 16;

  void add(FaultCause cause, uint32_t detail, uint32_t at_ms) {
    faults_[count_ % kKept] = {cause, detail, at_ms};
    ++count_;
  }
  // Ever noted; the last kKept of them can be read.
  uint32_t count() const { return count_; }
  uint32_t kept() const { return count_ < kKept ? count_ : kKept; }
  // `index` below kept(), the oldest first.
  const Fault& at(uint32_t index) const { return faults_[(count_ - kept() + index) % kKept]; }

  // The same, of a fault that stands: it keeps the outputs off until it clears.
  void raise(FaultCause cause, uint32_t detail, uint32_t at_ms) {
    add(cause, detail, at_ms);
    standing_ |= bit(cause);
  }
  void clear(FaultCause cause) { standing_ &= ~bit(cause); }
  bool stands(FaultCause cause) const { return (standing_ & bit(cause)) != 0; }
  bool any_stands() const { return (standing_ & ~kWarnings) != 0; }
  // Bit k for the k-th cause.
  uint32_t standing() const { return standing_; }
  bool only_the_table_stands() const {
    return (standing_ & ~kWarnings &
            ~(bit(FaultCause::kNoTable) | bit(FaultCause::kTableRefused) |
              bit(FaultCause::kBankRefused))) == 0;
  }

 private:
  static constexpr uint32_t bit(FaultCause cause) { return 1U << static_cast<uint32_t>(cause); }
  // They stand, and outputs play all the same.
  static constexpr uint32_t kWarnings = 1U << static_cast<uint32_t>(FaultCause::kOlderTable) |
                                        1U << static_cast<uint32_t>(FaultCause::kOlderBank) |
                                        1U << static_cast<uint32_t>(FaultCause::kNetworkHeld);

  std::array<Fault, kKept> faults_{};
  uint32_t count_ = 0;
  uint32_t standing_ = 0;
};

}  // namespace chladni
