#include "core/link/udp.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"
#include "core/generated/link_messages.hpp"

namespace chladni {

namespace {

namespace f = network_format;
using f::Kind;

constexpr uint32_t kWindowBits = 32;
// A host that streams or plays live is heard more often than this.
constexpr uint32_t kBusyMs = 200;
// A number handed out opens a session in this epoch or the next; a cookie is good as long.
constexpr uint32_t kEpochMs = 2000;
// Hellos without a cookie, from all sources: so many at once, and then one each 100 ms.
constexpr uint32_t kHelloMs = 100, kHellosAtOnce = 20;
constexpr uint32_t kWelcomeBytes = f::kHelloBytes - f::kHeadBytes - f::kMacBytes;

void put_head(Kind kind, uint32_t counter, const uint8_t* session, uint8_t* out) {
  put_word(out + f::kAtMagic, f::kDatagramMagic, 2);
  out[f::kAtVersion] = static_cast<uint8_t>(f::kVersion);
  out[f::kAtKind] = static_cast<uint8_t>(kind);
  put_word(out + f::kAtCounter, counter, 4);
  for (uint32_t k = 0; k < 8; ++k) out[f::kAtSession + k] = session[k];
}

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

void Datagrams::start() {
  state_ = {};
  Network network;
  if (!load_network(hal_, network) || !device_.may_start_network()) return;
  key_ = network.key;
  Mac mac{};
  state_.is_on = hal_.hmac_sha256(hal_.context, key_.data(), mac.data(), 1, mac.data());
  state_.port = network.port;
  state_.ssid = network.ssid;
  for (uint32_t k = 0; k < secret_.size(); k += 4) {
    put_word(secret_.data() + k, hal_.random(hal_.context), 4);
  }
  for (Session& session : sessions_) session = {};
  for (uint64_t& half : cookie_key_) {
    half = static_cast<uint64_t>(hal_.random(hal_.context)) << 32;
    half |= hal_.random(hal_.context);
  }
  credit_ms_ = kHelloMs * kHellosAtOnce;
  reckoned_ms_ = device_.now_ms();
}

void Datagrams::receive(const uint8_t* bytes, uint32_t count, uint32_t source) {
  if (!state_.is_on) return;
  poll();
  if (take(bytes, count, source)) {
    ++state_.accepted;
  } else {
    ++state_.rejected;
  }
}

bool Datagrams::take(const uint8_t* bytes, uint32_t count, uint32_t source) {
  // What costs nothing to tell comes first.
  if (count < f::kHeadBytes + f::kMacBytes || count > f::kMaxDatagram) return false;
  if (read_u16(bytes + f::kAtMagic) != f::kDatagramMagic || bytes[f::kAtVersion] != f::kVersion) {
    return false;
  }
  switch (static_cast<Kind>(bytes[f::kAtKind])) {
    case Kind::kHello: return count == f::kHelloBytes && take_hello(bytes, count, source);
    case Kind::kRequest: return take_request(bytes, count);
    case Kind::kAnswer:
    case Kind::kWelcome:
    case Kind::kChallenge: break;
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

// Cheap things first: none but who hears what goes to `source` makes the device look at a MAC for
// longer than the credit lasts, and what was answered is not again.
bool Datagrams::take_hello(const uint8_t* bytes, uint32_t count, uint32_t source) {
  const uint32_t crc = crc32(bytes, count);
  for (const uint32_t welcomed : welcomed_) {
    if (welcomed == crc) return false;
  }
  if (!has_cookie(bytes, source) && !may_come_without()) {
    challenge(bytes, source);
    return false;
  }
  if (!is_genuine(bytes, count)) return false;
  welcomed_[next_welcomed_] = crc;
  next_welcomed_ = (next_welcomed_ + 1U) % kWelcomed;
  welcome(bytes);
  return true;
}

uint32_t Datagrams::cookie(const uint8_t* hello, uint32_t source, uint32_t epoch) const {
  const uint8_t* const nonce = hello + f::kAtSession;
  const auto words = [](uint32_t low, uint32_t high) {
    return static_cast<uint64_t>(high) << 32 | low;
  };
  const SipHash::Message message{words(source, epoch), words(read_u32(nonce), read_u32(nonce + 4))};
  return static_cast<uint32_t>(SipHash::of(cookie_key_, message));
}

bool Datagrams::has_cookie(const uint8_t* hello, uint32_t source) const {
  const uint32_t shown = read_u32(hello + f::kAtCounter);
  return shown == cookie(hello, source, epoch()) || shown == cookie(hello, source, epoch() - 1U);
}

// While few come, as before there were cookies: a way there and back is spared (as RFC 7296, 2.6).
bool Datagrams::may_come_without() {
  const uint32_t room = kHelloMs * kHellosAtOnce - credit_ms_;
  const uint32_t passed = device_.now_ms() - reckoned_ms_;
  credit_ms_ += passed < room ? passed : room;
  reckoned_ms_ += passed;
  if (credit_ms_ < kHelloMs) return false;
  credit_ms_ -= kHelloMs;
  return true;
}

// Shorter than the hello, and without a MAC: its cookie is of use to no one else, and a wrong one
// costs its host another challenge.
void Datagrams::challenge(const uint8_t* hello, uint32_t source) const {
  std::array<uint8_t, f::kHeadBytes> out{};
  put_head(Kind::kChallenge, cookie(hello, source, epoch()), hello + f::kAtSession, out.data());
  hal_.send_datagram(hal_.context, out.data(), f::kHeadBytes);
}

// A request that was held back must not count for ever: a session without any is over, and its host
// begins another.
void Datagrams::poll() {
  for (Session& session : sessions_) {
    const bool is_silent = device_.now_ms() - session.heard_ms >= f::kSessionSilenceMs;
    const bool is_over = is_silent || session.taken.highest() >= f::kRenewAt;
    if (session.is_open && is_over) end(session);
  }
}

// What a host holds ends with it.
void Datagrams::end(Session& session) {
  session.is_open = false;
  const uint32_t serial = read_u32(session.id.data());
  if (serial > ended_serial_) ended_serial_ = serial;
  device_.leave(&session.host);
}

Datagrams::Session* Datagrams::find(const uint8_t* id) {
  for (Session& session : sessions_) {
    bool is_it = session.is_open;
    for (uint32_t k = 0; k < session.id.size(); ++k) is_it = is_it && session.id[k] == id[k];
    if (is_it) return &session;
  }
  return nullptr;
}

uint32_t Datagrams::epoch() const { return device_.now_ms() / kEpochMs; }

Datagrams::Id Datagrams::make_id(uint32_t serial, uint32_t epoch) const {
  std::array<uint8_t, 8> bytes{};
  put_word(bytes.data(), serial, 4);
  put_word(bytes.data() + 4, epoch, 4);
  Mac mac{};
  hal_.hmac_sha256(hal_.context, secret_.data(), bytes.data(), 8, mac.data());
  Id id{};
  for (uint32_t k = 0; k < 4; ++k) {
    id[k] = bytes[k];
    id[4 + k] = mac[k];
  }
  return id;
}

bool Datagrams::is_own_id(const uint8_t* id) const {
  if (read_u32(id) <= ended_serial_) return false;
  for (uint32_t back = 0; back < 2; ++back) {
    const Id own = make_id(read_u32(id), epoch() - back);
    if (read_u32(own.data() + 4) == read_u32(id + 4)) return true;
  }
  return false;
}

// In place of one that is over, else of the host that has been silent longest, unless all of them
// are at it.
Datagrams::Session* Datagrams::open(const uint8_t* id) {
  Session* found = nullptr;
  uint32_t best = 0;
  for (Session& session : sessions_) {
    const uint32_t silence_ms = device_.now_ms() - session.heard_ms;
    uint32_t rank = silence_ms < kBusyMs ? 0U : silence_ms;
    if (!session.is_open) rank = UINT32_MAX;
    if (rank > best) {
      best = rank;
      found = &session;
    }
  }
  if (found == nullptr) return nullptr;
  if (found->is_open) end(*found);
  *found = {};
  for (uint32_t k = 0; k < found->id.size(); ++k) found->id[k] = id[k];
  found->is_open = true;
  found->heard_ms = device_.now_ms();
  return found;
}

bool Datagrams::take_request(const uint8_t* bytes, uint32_t count) {
  // A session takes room only once a request of it has come, which none but who has the key can
  // send: a hello that was recorded and is sent again opens nothing.
  const uint8_t* const id = bytes + f::kAtSession;
  Session* session = find(id);
  if (session == nullptr && !is_own_id(id)) return false;
  if (!is_genuine(bytes, count)) return false;
  if (session == nullptr) session = open(id);
  if (session == nullptr) return false;
  const uint32_t size = count - f::kHeadBytes - f::kMacBytes;
  const uint8_t* const request = bytes + f::kHeadBytes;
  // Pieces of a table say where they belong; whatever else was overtaken is out of date.
  const bool may_be_late = size > 0 && request[0] == link_format::table_data::kCode;
  if (!session->taken.take(read_u32(bytes + f::kAtCounter), may_be_late)) return false;
  session->heard_ms = device_.now_ms();
  if (!requests_.take(session->host, request, size)) return false;
  send(Kind::kAnswer, ++session->answers, session->id.data(), session->host.answer.data(),
       session->host.answer_size);
  return true;
}

// The session the host has, if that runs on, or the number of a new one, of which nothing is kept.
void Datagrams::welcome(const uint8_t* hello) {
  const Session* const session = find(hello + f::kHeadBytes);
  const Id id = session != nullptr ? session->id : make_id(++last_serial_, epoch());
  std::array<uint8_t, kWelcomeBytes> body{};
  for (uint32_t k = 0; k < id.size(); ++k) body[k] = id[k];
  send(Kind::kWelcome, 0, hello + f::kAtSession, body.data(), kWelcomeBytes);
}

void Datagrams::send(Kind kind, uint32_t counter, const uint8_t* session, const uint8_t* body,
                     uint32_t size) {
  std::array<uint8_t, kMostSent> out{};
  put_head(kind, counter, session, out.data());
  for (uint32_t k = 0; k < size; ++k) out[f::kHeadBytes + k] = body[k];
  const uint32_t covered = f::kHeadBytes + size;
  Mac mac{};
  if (!hal_.hmac_sha256(hal_.context, key_.data(), out.data(), covered, mac.data())) return;
  for (uint32_t k = 0; k < f::kMacBytes; ++k) out[covered + k] = mac[k];
  hal_.send_datagram(hal_.context, out.data(), covered + f::kMacBytes);
}

}  // namespace chladni
