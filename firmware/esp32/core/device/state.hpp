// The device's states and what leads from one to the next; docs/device.md shows the same table.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/device_codes.hpp"

namespace chladni {

enum class DeviceEvent : uint8_t {
  kTouchBegins,
  kTouchEnds,
  kStreamBegins,
  kStreamEnds,
  kUpdateBegins,
  kUpdateEnds,
  kFaultArises,
  kFaultClears,
  kFingerLifts,  // and a lift pulse follows
  kRestartAsked,
};
constexpr uint32_t kDeviceEvents = 10;

// An event that is allowed in a state, and the state that it leads to.
struct Transition {
  DeviceState from;
  DeviceEvent event;
  DeviceState next;
};

namespace states {

using S = DeviceState;
using E = DeviceEvent;

// Whatever is not here is refused.
// clang-format off
constexpr std::array<Transition, 32> kTransitions = {{
    {S::kIdle, E::kTouchBegins, S::kPlaying},
    {S::kIdle, E::kStreamBegins, S::kStreaming},
    {S::kIdle, E::kUpdateBegins, S::kUpdating},
    {S::kIdle, E::kFaultArises, S::kFault},
    {S::kIdle, E::kRestartAsked, S::kRestarting},
    {S::kPlaying, E::kTouchBegins, S::kPlaying},
    {S::kPlaying, E::kTouchEnds, S::kIdle},
    {S::kPlaying, E::kFingerLifts, S::kLifted},
    {S::kPlaying, E::kStreamBegins, S::kStreaming},
    {S::kPlaying, E::kUpdateBegins, S::kUpdating},
    {S::kPlaying, E::kFaultArises, S::kFault},
    {S::kPlaying, E::kRestartAsked, S::kRestarting},
    {S::kLifted, E::kTouchBegins, S::kPlaying},
    {S::kLifted, E::kTouchEnds, S::kIdle},
    {S::kLifted, E::kStreamBegins, S::kStreaming},
    {S::kLifted, E::kUpdateBegins, S::kUpdating},
    {S::kLifted, E::kFaultArises, S::kFault},
    {S::kLifted, E::kRestartAsked, S::kRestarting},
    {S::kStreaming, E::kStreamEnds, S::kIdle},
    {S::kStreaming, E::kUpdateBegins, S::kUpdating},
    {S::kStreaming, E::kFaultArises, S::kFault},
    {S::kStreaming, E::kRestartAsked, S::kRestarting},
    // A fault is noted and stands, and shows once the update ends.
    {S::kUpdating, E::kUpdateEnds, S::kIdle},
    {S::kUpdating, E::kFaultArises, S::kUpdating},
    {S::kUpdating, E::kRestartAsked, S::kRestarting},
    // A host may stream if nothing but the table is missing.
    {S::kFault, E::kStreamBegins, S::kStreaming},
    {S::kFault, E::kUpdateBegins, S::kUpdating},
    {S::kFault, E::kFaultArises, S::kFault},
    {S::kFault, E::kFaultClears, S::kIdle},
    {S::kFault, E::kRestartAsked, S::kRestarting},
    // Nothing leads out of it.
    {S::kRestarting, E::kFaultArises, S::kRestarting},
    {S::kRestarting, E::kRestartAsked, S::kRestarting},
}};
// clang-format on

}  // namespace states

// Null if the event is refused.
constexpr const Transition* transition(DeviceState from, DeviceEvent event) {
  for (const Transition& one : states::kTransitions) {
    if (one.from == from && one.event == event) return &one;
  }
  return nullptr;
}

namespace states {

constexpr bool is_each_there_once() {
  for (const Transition& one : kTransitions) {
    if (transition(one.from, one.event) != &one) return false;
  }
  return true;
}
static_assert(is_each_there_once(), "a state and an event have two rows");

constexpr bool leads(S from, E event, S next) {
  const Transition* const found = transition(from, event);
  return found != nullptr && found->next == next;
}

// Whatever the device does, a fault turns its outputs off and a restart is possible.
constexpr bool may_stop_anywhere() {
  for (uint32_t k = 0; k < kDeviceStates; ++k) {
    const auto from = static_cast<S>(k);
    const bool is_off = from == S::kUpdating || from == S::kRestarting;
    if (!leads(from, E::kFaultArises, is_off ? from : S::kFault)) return false;
    if (!leads(from, E::kRestartAsked, S::kRestarting)) return false;
  }
  return true;
}
static_assert(may_stop_anywhere(), "a state goes on through a fault, or refuses a restart");

constexpr bool is_final(S state) {
  for (const Transition& one : kTransitions) {
    if (one.from == state && one.next != state) return false;
  }
  return true;
}
static_assert(is_final(S::kRestarting), "something leads out of a restart");

}  // namespace states

constexpr const char* to_text(DeviceEvent event) {
  switch (event) {
    case DeviceEvent::kTouchBegins: return "touch begins";
    case DeviceEvent::kTouchEnds: return "touch ends";
    case DeviceEvent::kStreamBegins: return "stream begins";
    case DeviceEvent::kStreamEnds: return "stream ends";
    case DeviceEvent::kUpdateBegins: return "update begins";
    case DeviceEvent::kUpdateEnds: return "update ends";
    case DeviceEvent::kFaultArises: return "fault arises";
    case DeviceEvent::kFaultClears: return "fault clears";
    case DeviceEvent::kFingerLifts: return "finger lifts";
    case DeviceEvent::kRestartAsked: return "restart asked";
  }
  return "unknown";
}

}  // namespace chladni
