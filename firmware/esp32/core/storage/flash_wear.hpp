// Whether flash may be written once more: a sector stands 100,000 erases, and a host may ask for
// one after another without end. A credit is one update: a slot's erase and its entry, a switch of
// tables, a configuration, or a network record. None erases a sector twice, so a sector has stood
// as many erases as there were updates, at most.
#pragma once

#include <cstdint>

#include "core/storage/boot_log.hpp"

namespace chladni {

class FlashWear {
 public:
  // What is known from before this start; after a loss of power the log alone knows, and a credit
  // is missing for each update that no minute has made up for.
  void start(BootLog& log, uint32_t erases, uint32_t credit_ms) {
    log_ = &log;
    erases_ = erases;
    if (credit_ms == kUnknownMs) credit_ms = (BootLog::kMostOwed - log.owed()) * kPerUpdateMs;
    credit_ms_ = credit_ms < kMostMs ? credit_ms : kMostMs;
  }
  void pass(const Hal& hal, uint32_t milliseconds, bool is_quiet) {
    const uint32_t room = kMostMs - credit_ms_;
    credit_ms_ += milliseconds < room ? milliseconds : room;
    if (log_->owed() == 0) return;
    since_ms_ += milliseconds;
    if (since_ms_ < kPerUpdateMs || !is_quiet) return;
    since_ms_ = 0;
    log_->enter_minute(hal);
  }
  bool may_write() const { return credit_ms_ >= kPerUpdateMs; }
  // An update; before it erases, so that no loss of power forgets it. Only if it may.
  void spend(const Hal& hal) {
    if (log_->owed() == 0) since_ms_ = 0;
    credit_ms_ -= may_write() ? kPerUpdateMs : credit_ms_;
    log_->enter_update(hal);
  }
  void count(uint32_t erases) { erases_ += erases; }

  // Sectors, since power came on.
  uint32_t erases() const { return erases_; }
  // Updates, ever.
  uint32_t updates() const { return log_->updates(); }
  uint32_t credit_ms() const { return credit_ms_; }

 private:
  // So many in a row, and one more for each minute that passes.
  static constexpr uint32_t kPerUpdateMs = 60000, kAtOnce = 60;
  static constexpr uint32_t kMostMs = kPerUpdateMs * kAtOnce;
  static constexpr uint32_t kUnknownMs = UINT32_MAX;  // Retained

  BootLog* log_ = nullptr;
  uint32_t erases_ = 0;
  uint32_t credit_ms_ = 0;
  uint32_t since_ms_ = 0;  // the last update, or minute that made up for one
};

}  // namespace chladni
