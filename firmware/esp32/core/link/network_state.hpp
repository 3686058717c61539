// What the device says of its network; kept by udp.cpp, and the address by the chip.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/network_format.hpp"

namespace chladni {

struct NetworkState {
  bool is_on = false;
  uint16_t port = 0;
  uint32_t address = 0;  // IPv4, its first byte lowest; 0 for none
  uint32_t accepted = 0;
  uint32_t rejected = 0;
  std::array<char, network_format::kSsidBytes + 1> ssid{};
};

}  // namespace chladni
