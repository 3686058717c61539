// The device's end of a network: requests in datagrams that carry a MAC, and each is taken once
// (docs/security.md). Off until a key was set over the wire.
#pragma once

#include <array>
#include <cstdint>

#include "core/generated/network_format.hpp"
#include "core/link/requests.hpp"
#include "core/storage/network_record.hpp"

namespace chladni {

// Which counters were taken, so that none is taken twice.
class ReplayWindow {
 public:
  // Whether this one is new; then it no longer is. One below the highest is too late, unless it may
  // be late by up to 31 (as RFC 4303, 3.4.3).
  bool take(uint32_t counter, bool may_be_late);
  uint32_t highest() const { return highest_; }

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

  // One datagram, in the main loop.
  void receive(const uint8_t* bytes, uint32_t count);

 private:
  // Hosts at once, and hellos whose first request has not come yet.
  static constexpr uint32_t kSessions = 6;
  static constexpr uint32_t kMostSent =
      network_format::kHeadBytes + Conversation::kMostAnswer + network_format::kMacBytes;
  using Mac = std::array<uint8_t, 32>;
  using Id = std::array<uint8_t, 8>;

  // What a device and one host have agreed on. Its number is never drawn again, so that once it is
  // over nothing that was recorded of it counts.
  struct Session {
    Id id{};
    bool is_open = false;
    bool is_in_use = false;  // a request has come: hellos, which anybody may replay, do not end it
    uint32_t heard_ms = 0;
    ReplayWindow taken;
    uint32_t answers = 0;
    Conversation host;
  };

  bool take(const uint8_t* bytes, uint32_t count);
  bool is_genuine(const uint8_t* bytes, uint32_t count) const;
  bool take_request(const uint8_t* bytes, uint32_t count);
  bool take_hello(const uint8_t* bytes);
  void end_old_sessions();
  Session* find(const uint8_t* id);
  Session* open();
  void send(network_format::Kind kind, uint32_t counter, const uint8_t* session,
            const uint8_t* body, uint32_t size);

  Device& device_;
  Requests requests_;
  Hal hal_{};
  std::array<uint8_t, network_format::kKeyBytes> key_{};
  std::array<Session, kSessions> sessions_{};
};

}  // namespace chladni
