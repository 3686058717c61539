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

struct Transition {
  bool is_allowed;
  DeviceState next;
};

constexpr Transition kNo{false, DeviceState::kIdle};
constexpr Transition to(DeviceState next) { return {true, next}; }

// By state and event. A fault while updating is noted and stands, and shows once that ends.
constexpr std::array<std::array<Transition, kDeviceEvents>, kDeviceStates> kTransitions = {{
    // idle
    {{to(DeviceState::kPlaying), kNo, to(DeviceState::kStreaming), kNo, to(DeviceState::kUpdating),
      kNo, to(DeviceState::kFault), kNo, kNo, to(DeviceState::kRestarting)}},
    // playing
    {{to(DeviceState::kPlaying), to(DeviceState::kIdle), to(DeviceState::kStreaming), kNo,
      to(DeviceState::kUpdating), kNo, to(DeviceState::kFault), kNo, to(DeviceState::kLifted),
      to(DeviceState::kRestarting)}},
    // streaming
    {{kNo, kNo, kNo, to(DeviceState::kIdle), to(DeviceState::kUpdating), kNo,
      to(DeviceState::kFault), kNo, kNo, to(DeviceState::kRestarting)}},
    // updating
    {{kNo, kNo, kNo, kNo, kNo, to(DeviceState::kIdle), to(DeviceState::kUpdating), kNo, kNo,
      to(DeviceState::kRestarting)}},
    // fault; a host may stream if nothing but the table is missing
    {{kNo, kNo, to(DeviceState::kStreaming), kNo, to(DeviceState::kUpdating), kNo,
      to(DeviceState::kFault), to(DeviceState::kIdle), kNo, to(DeviceState::kRestarting)}},
    // lifted
    {{to(DeviceState::kPlaying), to(DeviceState::kIdle), to(DeviceState::kStreaming), kNo,
      to(DeviceState::kUpdating), kNo, to(DeviceState::kFault), kNo, kNo,
      to(DeviceState::kRestarting)}},
    // restarting: nothing leads out of it
    {{kNo, kNo, kNo, kNo, kNo, kNo, to(DeviceState::kRestarting), kNo, kNo,
      to(DeviceState::kRestarting)}},
}};

constexpr Transition transition(DeviceState state, DeviceEvent event) {
  return kTransitions[static_cast<uint32_t>(state)][static_cast<uint32_t>(event)];
}

const char* to_text(DeviceEvent event);

}  // namespace chladni
