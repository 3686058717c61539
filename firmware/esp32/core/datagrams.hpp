// The device's end of a network: requests in datagrams that carry a MAC, and each is taken once
// (docs/security.md). Off until a key was set over the wire.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/network_format.hpp"
#include "core/network.hpp"
#include "core/requests.hpp"

namespace chladni {

// Which counters were taken, so that nothing is taken twice: those up to 32 below the highest may
// still come, as a network may let one overtake another (as RFC 4303, 3.4.3).
class ReplayWindow {
 public:
  // Whether this one is new; then it no longer is.
  bool take(uint32_t counter);
  uint32_t highest() const { return highest_; }
  void clear() { highest_ = seen_ = 0; }

 private:
  uint32_t highest_ = 0;
  uint32_t seen_ = 0;  // bit k: `highest_` - k was taken
};

class Datagrams {
 public:
  explicit Datagrams(Device& device)
      : device_(device), requests_(device, Requests::Via::kNetwork) {}

  // Reads the record; without a whole one, or without a way to make a MAC, it stays off.
  void start(const Hal& hal);
  const Network& network() const { return network_; }

  // One datagram, in the main loop.
  void receive(const uint8_t* bytes, uint32_t count);

 private:
  static constexpr uint32_t kSessionBytes = 8;
  static constexpr uint32_t kMostSent =
      network_format::kHeadBytes + Requests::kMostAnswer + network_format::kMacBytes;
  using Mac = std::array<uint8_t, 32>;

  bool take(const uint8_t* bytes, uint32_t count);
  bool is_genuine(const uint8_t* bytes, uint32_t count) const;
  bool take_request(const uint8_t* bytes, uint32_t count);
  void welcome(const uint8_t* nonce);
  void begin_session();
  void send(network_format::Kind kind, uint32_t counter, const uint8_t* session,
            const uint8_t* body, uint32_t size);

  Device& device_;
  Requests requests_;
  Hal hal_{};
  Network network_;
  ReplayWindow taken_;
  uint32_t answers_ = 0;
  std::array<uint8_t, kSessionBytes> session_{};
};

}  // namespace chladni
