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
};
constexpr uint32_t kDeviceEvents = 8;

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
      kNo, to(DeviceState::kFault), kNo}},
    // playing
    {{to(DeviceState::kPlaying), to(DeviceState::kIdle), to(DeviceState::kStreaming), kNo,
      to(DeviceState::kUpdating), kNo, to(DeviceState::kFault), kNo}},
    // streaming
    {{kNo, kNo, kNo, to(DeviceState::kIdle), to(DeviceState::kUpdating), kNo,
      to(DeviceState::kFault), kNo}},
    // updating
    {{kNo, kNo, kNo, kNo, kNo, to(DeviceState::kIdle), to(DeviceState::kUpdating), kNo}},
    // fault; a host may stream if nothing but the table is missing
    {{kNo, kNo, to(DeviceState::kStreaming), kNo, to(DeviceState::kUpdating), kNo,
      to(DeviceState::kFault), to(DeviceState::kIdle)}},
}};

constexpr Transition transition(DeviceState state, DeviceEvent event) {
  return kTransitions[static_cast<uint32_t>(state)][static_cast<uint32_t>(event)];
}

const char* to_text(DeviceEvent event);

}  // namespace chladni
