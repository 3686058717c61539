// What the device notices by itself, and ends: an interrupt that stops or comes late, deadlines,
// hot coils, a supply that is asked for too much.
#include "core/device/device.hpp"

namespace chladni {

// All deadlines are counted by the interrupt; if it dies, a duty stays where it was. The gates are
// cut past it, and only a start gives them back.
void Device::watch_samples() {
  const uint32_t stopped_us = output_watch_.stopped_us(synthesis_, now_us());
  if (stopped_us != 0) cut_outputs(stopped_us);
}

void Device::cut_outputs(uint32_t stopped_us) {
  if (faults_.stands(FaultCause::kInterruptStopped)) return;
  hal_.cut_outputs(hal_.context);
  stand(FaultCause::kInterruptStopped, stopped_us / 1000U);
}

// What the interrupt ended by itself.
void Device::watch_outputs() {
  if (touch_.is_starting()) return;
  switch (output_watch_.fade(synthesis_)) {
    case FadeCause::kTouchTimeout:
      if (is_of_a_finger()) {
        note(FaultCause::kTouchTimeout, 0);
        break_touch();
      } else if (state_ == DeviceState::kStreaming) {
        note(FaultCause::kHostSilent, 0);
        stream_end();
      }
      break;
    case FadeCause::kMaxOn:
      // A finger has to lift first; a host may have died, and must not be in the next finger's way.
      if (input_.let_go() && is_of_a_finger()) {
        note(FaultCause::kTouchTooLong, 0);
        break_touch();
      } else {
        stand(FaultCause::kTouchTooLong, 0);
      }
      break;
    case FadeCause::kLate: stand(FaultCause::kInterruptLate, synthesis_.missed()); break;
    case FadeCause::kUnderrun:
      note(FaultCause::kUnderrun, 0);
      host_.refill();
      break;
    case FadeCause::kNone:
    case FadeCause::kReleased: break;
  }
}

void Device::watch_limits(uint32_t passed_ms) {
  bool is_stuck = false;
  if (passed_ms > 0) {
    Squares squares{};
    // Where the gates are cut nothing comes of the duties.
    const bool is_cut = faults_.stands(FaultCause::kInterruptStopped);
    if (!is_cut) is_stuck = !synthesis_.take_squares(squares, passed_ms);
    supply_.add(squares, passed_ms);
    if (heat_.add(squares, passed_ms)) keep_retained(!is_quiet());
  }
  const uint32_t hot = heat_.hot_channel();
  if (hot < kMaxChannels && !faults_.stands(FaultCause::kCoilHot)) {
    stand(FaultCause::kCoilHot, hot);
  }
  // Waves are reckoned when they are posted, and frames when they are pushed: this is for the rest.
  const bool is_streamed = state_ == DeviceState::kStreaming && !host_.has_waves();
  const bool has_frames = is_streamed || !supply_.may_start_wave();
  if (!supply_.is_passed(has_frames ? synthesis_.stream().crest_ma() : 0U)) return;
  stand_supply();
  if (is_quiet()) return;
  synthesis_.stop(Stop::kAtOnce);
  if (is_stuck) cut_outputs(1000U * passed_ms);
}

void Device::stand_supply() {
  if (faults_.stands(FaultCause::kSupplyCurrent)) return;
  stand(FaultCause::kSupplyCurrent, supply_.mean_ma());
}

void Device::clear_faults() {
  if (!input_.is_touched() && is_quiet()) {
    if (heat_.has_cooled()) faults_.clear(FaultCause::kCoilHot);
    faults_.clear(FaultCause::kTouchTooLong);
    faults_.clear(FaultCause::kInterruptLate);
    // The mean that raised it goes on for a window.
    if (supply_.mean_ma() <= config().supply_ma) faults_.clear(FaultCause::kSupplyCurrent);
  }
  settle();
}

}  // namespace chladni
