#include "core/link/udp.hpp"

#include "core/base/bytes.hpp"

namespace chladni {

namespace {

namespace f = network_format;
using f::Kind;

constexpr uint32_t kWindowBits = 32;
// A host that streams or plays live is heard more often than this.
constexpr uint32_t kBusyMs = 200;
constexpr uint32_t kWelcomeBytes = f::kHelloBytes - f::kHeadBytes - f::kMacBytes;

}  // namespace

bool ReplayWindow::take(uint32_t counter, bool may_be_late) {
  if (counter == 0) return false;
  if (counter > highest_) {
    const uint32_t ahead = counter - highest_;
    seen_ = (ahead < kWindowBits ? seen_ << ahead : 0U) | 1U;
    highest_ = counter;
    return true;
  }
  const uint32_t behind = highest_ - counter;
  if (!may_be_late || behind >= kWindowBits || ((seen_ >> behind) & 1U) != 0) return false;
  seen_ |= 1U << behind;
  return true;
}

void Datagrams::start(const Hal& hal) {
  hal_ = hal;
  NetworkState& state = device_.network();
  state = {};
  Network network;
  if (!load_network(hal_, network)) return;
  key_ = network.key;
  Mac mac{};
  state.is_on = hal_.hmac_sha256(hal_.context, key_.data(), mac.data(), 1, mac.data());
  state.port = network.port;
  state.ssid = network.ssid;
  for (Session& session : sessions_) session = {};
}

void Datagrams::receive(const uint8_t* bytes, uint32_t count) {
  NetworkState& state = device_.network();
  if (!state.is_on) return;
  end_old_sessions();
  if (take(bytes, count)) {
    ++state.accepted;
  } else {
    ++state.rejected;
  }
}

bool Datagrams::take(const uint8_t* bytes, uint32_t count) {
  // What costs nothing to tell comes first.
  if (count < f::kHeadBytes + f::kMacBytes || count > f::kMaxDatagram) return false;
  if (read_u16(bytes + f::kAtMagic) != f::kDatagramMagic || bytes[f::kAtVersion] != f::kVersion) {
    return false;
  }
  switch (static_cast<Kind>(bytes[f::kAtKind])) {
    case Kind::kHello:
      return count == f::kHelloBytes && is_genuine(bytes, count) && take_hello(bytes);
    case Kind::kRequest: return take_request(bytes, count);
    case Kind::kAnswer:
    case Kind::kWelcome: break;
  }
  return false;
}

bool Datagrams::is_genuine(const uint8_t* bytes, uint32_t count) const {
  Mac mac{};
  const uint32_t covered = count - f::kMacBytes;
  if (!hal_.hmac_sha256(hal_.context, key_.data(), bytes, covered, mac.data())) {
    return false;
  }
  // All bytes are looked at, so that the time it takes tells nothing.
  uint32_t differences = 0;
  for (uint32_t k = 0; k < f::kMacBytes; ++k) {
    differences |= static_cast<uint32_t>(mac[k] ^ bytes[covered + k]);
  }
  return differences == 0;
}

// A request that was held back must not count for ever: a session without any is over, and its host
// begins another.
void Datagrams::end_old_sessions() {
  for (Session& session : sessions_) {
    const bool is_silent = device_.now_ms() - session.heard_ms >= f::kSessionSilenceMs;
    if (is_silent || session.taken.highest() >= f::kRenewAt) session.is_open = false;
  }
}

Datagrams::Session* Datagrams::find(const uint8_t* id) {
  for (Session& session : sessions_) {
    bool is_it = session.is_open;
    for (uint32_t k = 0; k < session.id.size(); ++k) is_it = is_it && session.id[k] == id[k];
    if (is_it) return &session;
  }
  return nullptr;
}

// In place of one that is over; else of the oldest hello that nothing came of; else of the host
// that has been silent longest, unless all of them are at it.
Datagrams::Session* Datagrams::open() {
  Session* found = nullptr;
  uint32_t best = 0;
  for (Session& session : sessions_) {
    const uint32_t silence_ms = device_.now_ms() - session.heard_ms;
    // Each kind of place goes before all of the next; silences are shorter than a session may be.
    uint32_t rank = silence_ms;
    if (session.is_in_use && silence_ms < kBusyMs) rank = 0;
    if (!session.is_in_use) rank += f::kSessionSilenceMs + 1U;
    if (!session.is_open) rank = UINT32_MAX;
    if (rank > best) {
      best = rank;
      found = &session;
    }
  }
  if (found == nullptr) return nullptr;
  *found = {};
  for (uint32_t k = 0; k < found->id.size(); k += 4) {
    put_word(&found->id[k], hal_.random(hal_.context), 4);
  }
  found->is_open = true;
  found->heard_ms = device_.now_ms();
  return found;
}

bool Datagrams::take_request(const uint8_t* bytes, uint32_t count) {
  Session* const session = find(bytes + f::kAtSession);
  if (session == nullptr || !is_genuine(bytes, count)) return false;
  const uint32_t size = count - f::kHeadBytes - f::kMacBytes;
  const uint8_t* const request = bytes + f::kHeadBytes;
  // Pieces of a table say where they belong; whatever else was overtaken is out of date.
  const bool may_be_late = size > 0 && request[0] == link_format::table_data::kCode;
  if (!session->taken.take(read_u32(bytes + f::kAtCounter), may_be_late)) return false;
  session->is_in_use = true;
  session->heard_ms = device_.now_ms();
  if (!requests_.take(session->host, request, size)) return false;
  send(Kind::kAnswer, ++session->answers, session->id.data(), session->host.answer.data(),
       session->host.answer_size);
  return true;
}

// Answered with the session the host has, if that runs on, or with a new one.
bool Datagrams::take_hello(const uint8_t* bytes) {
  const Session* session = find(bytes + f::kHeadBytes);
  if (session == nullptr) session = open();
  if (session == nullptr) return false;
  std::array<uint8_t, kWelcomeBytes> body{};
  for (uint32_t k = 0; k < session->id.size(); ++k) body[k] = session->id[k];
  send(Kind::kWelcome, 0, bytes + f::kAtSession, body.data(), kWelcomeBytes);
  return true;
}

void Datagrams::send(Kind kind, uint32_t counter, const uint8_t* session, const uint8_t* body,
                     uint32_t size) {
  std::array<uint8_t, kMostSent> out{};
  put_word(&out[f::kAtMagic], f::kDatagramMagic, 2);
  out[f::kAtVersion] = static_cast<uint8_t>(f::kVersion);
  out[f::kAtKind] = static_cast<uint8_t>(kind);
  put_word(&out[f::kAtCounter], counter, 4);
  for (uint32_t k = 0; k < Id{}.size(); ++k) out[f::kAtSession + k] = session[k];
  for (uint32_t k = 0; k < size; ++k) out[f::kHeadBytes + k] = body[k];
  const uint32_t covered = f::kHeadBytes + size;
  Mac mac{};
  if (!hal_.hmac_sha256(hal_.context, key_.data(), out.data(), covered, mac.data())) return;
  for (uint32_t k = 0; k < f::kMacBytes; ++k) out[covered + k] = mac[k];
  hal_.send_datagram(hal_.context, out.data(), covered + f::kMacBytes);
}

}  // namespace chladni
