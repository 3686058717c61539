// The device's end of a network: requests in datagrams that carry a MAC, and each is taken once
// (docs/security.md). Off until a key was set over the wire.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/siphash.hpp"
#include "core/generated/network_format.hpp"
#include "core/link/network_state.hpp"
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
      : device_(device), hal_(device.hal()), requests_(device, state_, Requests::Via::kNetwork) {}

  // Reads the record; without a whole one, or without a way to make a MAC, it stays off. The device
  // has started.
  void start();

  // Every turn of the main loop: sessions end, and what their hosts held ends with them.
  void poll();
  // One datagram, in the main loop; `source` tells who sent it, as far as that can be believed.
  void receive(const uint8_t* bytes, uint32_t count, uint32_t source);

  // The device's own on this network, IPv4 with its first byte lowest; 0 while it has none.
  void set_address(uint32_t address) { state_.address = address; }
  const NetworkState& state() const { return state_; }

 private:
  // Hosts at once.
  static constexpr uint32_t kSessions = 6;
  // Hellos that were answered last, and are not again.
  static constexpr uint32_t kWelcomed = 16;
  static constexpr uint32_t kMostSent =
      network_format::kHeadBytes + Conversation::kMostAnswer + network_format::kMacBytes;
  using Mac = std::array<uint8_t, 32>;
  using Id = std::array<uint8_t, 8>;

  // What a device and one host have agreed on. Its number is never drawn again, so that once it is
  // over nothing that was recorded of it counts.
  struct Session {
    Id id{};
    bool is_open = false;
    uint32_t heard_ms = 0;
    ReplayWindow taken;
    uint32_t answers = 0;
    Conversation host;
  };

  bool take(const uint8_t* bytes, uint32_t count, uint32_t source);
  bool take_hello(const uint8_t* bytes, uint32_t count, uint32_t source);
  // What a hello must bring along while many come: only who hears what the device sends to `source`
  // has it, and it is good for a few seconds.
  uint32_t cookie(const uint8_t* hello, uint32_t source, uint32_t epoch) const;
  bool has_cookie(const uint8_t* hello, uint32_t source) const;
  bool may_come_without();
  void challenge(const uint8_t* hello, uint32_t source) const;
  void welcome(const uint8_t* hello);
  bool is_genuine(const uint8_t* bytes, uint32_t count) const;
  bool take_request(const uint8_t* bytes, uint32_t count);
  Session* find(const uint8_t* id);
  Session* open(const uint8_t* id);
  // A number that only this device can have made, and that it need not remember: it is of use for a
  // few seconds, to whoever has the key.
  Id make_id(uint32_t serial, uint32_t epoch) const;
  bool is_own_id(const uint8_t* id) const;
  uint32_t epoch() const;
  void end(Session& session);
  void send(network_format::Kind kind, uint32_t counter, const uint8_t* session,
            const uint8_t* body, uint32_t size);

  Device& device_;
  const Hal& hal_;
  NetworkState state_;
  Requests requests_;
  std::array<uint8_t, network_format::kKeyBytes> key_{};
  // Numbers count up. Below the last one whose session has ended none opens any more: what was
  // recorded of a session does not open it again.
  uint32_t last_serial_ = 0;
  uint32_t ended_serial_ = 0;
  // Drawn at each start.
  std::array<uint8_t, network_format::kKeyBytes> secret_{};
  SipHash::Key cookie_key_{};
  std::array<Session, kSessions> sessions_{};
  // CRCs of the hellos that were answered last, and where the next one goes.
  std::array<uint32_t, kWelcomed> welcomed_{};
  uint32_t next_welcomed_ = 0;
  // Hellos that may come without a cookie just now, and when that was reckoned.
  uint32_t credit_ms_ = 0;
  uint32_t reckoned_ms_ = 0;
};

}  // namespace chladni
