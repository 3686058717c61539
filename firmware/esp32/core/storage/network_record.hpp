// What a device needs to be reached over a network: kept in flash, set over the wire only.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/network_format.hpp"
#include "core/hal.hpp"

namespace chladni {

struct Network {
  uint16_t port = 0;
  std::array<uint8_t, network_format::kKeyBytes> key{};
  // One byte more than flash has, so that both end in a zero.
  std::array<char, network_format::kSsidBytes + 1> ssid{};
  std::array<char, network_format::kPassphraseBytes + 1> passphrase{};
};

// A record's fields; false if it is none, or damaged.
bool parse_network(const uint8_t* record, uint32_t size, Network& network);

// False if there is no whole record: the network stays off.
bool load_network(const Hal& hal, Network& network);

// Keeps a record for the next start, or none if `size` is 0, and reads it back. A cut meanwhile
// leaves none: then the network is off until it is set again.
bool save_network(const Hal& hal, const uint8_t* record, uint32_t size);

}  // namespace chladni
