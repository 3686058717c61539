#include "emulator/emulator.hpp"

#include <new>

namespace chladni::emulator {

namespace {

constexpr uint64_t kTimerHz = 80000000;
constexpr uint64_t kPollUs = 1000;

}  // namespace

Emulator::Emulator(const EmulatorSettings& settings)
    : settings_(settings),
      flash_(settings.flash_sectors),
      pwm_(settings.channels, settings.pwm_bits) {}

uint64_t Emulator::now_us() const { return (period_ << settings_.pwm_bits) * 1000000U / kTimerHz; }

Hal Emulator::hal() {
  Hal hal{};
  hal.context = this;
  hal.now_us = [](void* context) { return static_cast<uint32_t>(from(context).now_us()); };
  hal.set_duty = [](void* context, uint32_t channel, uint32_t duty) {
    Emulator& self = from(context);
    self.note(self.pwm_.write(self.period_, channel, duty));
  };
  hal.poll_touch = [](void* context, Place* place) { return from(context).report(place); };
  hal.read_table = [](void* context, uint32_t offset, uint8_t* bytes, uint32_t count) {
    return from(context).flash_.read(offset, bytes, count);
  };
  hal.print = [](void* context, const char* line) { from(context).printed_.emplace_back(line); };
  return hal;
}

TableStatus Emulator::boot() {
  // The device holds atomics and cannot be assigned; power-on means made anew in place.
  pwm_.reset();
  is_booted_ = true;
  device_.~Device();
  new (&device_) Device();
  return device_.start(hal(), {settings_.channels, settings_.pwm_bits, settings_.level_q15});
}

Touch Emulator::report(Place* place) {
  const uint64_t now = now_us();
  while (next_finger_ < fingers_.size() && fingers_[next_finger_].at_us <= now) {
    const FingerEvent& event = fingers_[next_finger_++];
    if (is_finger_down_ && !event.is_down) is_lift_unreported_ = true;
    // A panel that sees a finger arrive reports at once, then at its own rate.
    if (!is_finger_down_ && event.is_down) next_report_us_ = now;
    is_finger_down_ = event.is_down;
    if (event.is_down) finger_ = event.place;
  }
  if (is_lift_unreported_ && is_next_lift_lost_) is_lift_unreported_ = is_next_lift_lost_ = false;
  if (is_panel_silent_ || now < next_report_us_) return Touch::kNothingNew;
  if (is_finger_down_) {
    next_report_us_ = now + settings_.panel_period_us;
    *place = finger_;
    return Touch::kContact;
  }
  if (is_lift_unreported_) {
    is_lift_unreported_ = false;
    return Touch::kLifted;
  }
  return Touch::kNothingNew;
}

void Emulator::run_us(uint64_t microseconds) {
  const uint64_t end = now_us() + microseconds;
  if (!is_booted_) note("the board is not powered on");
  while (now_us() < end && fault_.empty()) {
    pwm_.begin_period();
    if (period_ % kCarrierPeriodsPerSample == 0) device_.sample();
    if (now_us() >= next_poll_us_) {
      next_poll_us_ += kPollUs;
      if (!is_main_loop_hung_) device_.poll();
    }
    ++period_;
  }
}

}  // namespace chladni::emulator
