#include "core/datagrams.hpp"

#include "core/bytes.hpp"

namespace chladni {

namespace {

namespace f = network_format;
using f::Kind;

constexpr uint32_t kWindowBits = 32;
constexpr uint32_t kWelcomeBytes = f::kHelloBytes - f::kHeadBytes - f::kMacBytes;

}  // namespace

bool ReplayWindow::take(uint32_t counter) {
  if (counter == 0) return false;
  if (counter > highest_) {
    const uint32_t ahead = counter - highest_;
    seen_ = (ahead < kWindowBits ? seen_ << ahead : 0U) | 1U;
    highest_ = counter;
    return true;
  }
  const uint32_t behind = highest_ - counter;
  if (behind >= kWindowBits || ((seen_ >> behind) & 1U) != 0) return false;
  seen_ |= 1U << behind;
  return true;
}

void Datagrams::start(const Hal& hal) {
  hal_ = hal;
  NetworkState& state = device_.network();
  state = {};
  state.is_on = load_network(hal_, network_);
  if (!state.is_on) return;
  Mac mac{};
  state.is_on = hal_.hmac_sha256(hal_.context, network_.key.data(), mac.data(), 1, mac.data());
  state.port = network_.port;
  state.ssid = network_.ssid;
  begin_session();
}

// Counters begin anew in a session that nobody can foretell, so nothing of an older one counts.
void Datagrams::begin_session() {
  for (uint32_t k = 0; k < kSessionBytes; k += 4) {
    put_word(&session_[k], hal_.random(hal_.context), 4);
  }
  taken_.clear();
  answers_ = 0;
}

void Datagrams::receive(const uint8_t* bytes, uint32_t count) {
  NetworkState& state = device_.network();
  if (!state.is_on) return;
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
      if (count != f::kHelloBytes || !is_genuine(bytes, count)) return false;
      welcome(bytes + f::kAtSession);
      return true;
    case Kind::kRequest: return is_genuine(bytes, count) && take_request(bytes, count);
    case Kind::kAnswer:
    case Kind::kWelcome: break;
  }
  return false;
}

bool Datagrams::is_genuine(const uint8_t* bytes, uint32_t count) const {
  Mac mac{};
  const uint32_t covered = count - f::kMacBytes;
  if (!hal_.hmac_sha256(hal_.context, network_.key.data(), bytes, covered, mac.data())) {
    return false;
  }
  // All bytes are looked at, so that the time it takes tells nothing.
  uint32_t differences = 0;
  for (uint32_t k = 0; k < f::kMacBytes; ++k) {
    differences |= static_cast<uint32_t>(mac[k] ^ bytes[covered + k]);
  }
  return differences == 0;
}

bool Datagrams::take_request(const uint8_t* bytes, uint32_t count) {
  for (uint32_t k = 0; k < kSessionBytes; ++k) {
    if (bytes[f::kAtSession + k] != session_[k]) return false;
  }
  if (!taken_.take(read_u32(bytes + f::kAtCounter))) return false;
  const uint32_t size = count - f::kHeadBytes - f::kMacBytes;
  if (!requests_.take(bytes + f::kHeadBytes, size)) return false;
  send(Kind::kAnswer, ++answers_, session_.data(), requests_.answer(), requests_.answer_size());
  requests_.finish();
  return true;
}

// Says which session runs and how far it is. A hello that is replayed gets this and changes
// nothing, but for a session so old that it is renewed.
void Datagrams::welcome(const uint8_t* nonce) {
  if (taken_.highest() >= f::kRenewAt || answers_ >= f::kRenewAt) begin_session();
  std::array<uint8_t, kWelcomeBytes> body{};
  for (uint32_t k = 0; k < kSessionBytes; ++k) body[f::kWelcomeAtSession + k] = session_[k];
  put_word(&body[f::kWelcomeAtRequests], taken_.highest(), 4);
  put_word(&body[f::kWelcomeAtAnswers], answers_, 4);
  send(Kind::kWelcome, 0, nonce, body.data(), kWelcomeBytes);
}

void Datagrams::send(Kind kind, uint32_t counter, const uint8_t* session, const uint8_t* body,
                     uint32_t size) {
  std::array<uint8_t, kMostSent> out{};
  put_word(&out[f::kAtMagic], f::kDatagramMagic, 2);
  out[f::kAtVersion] = static_cast<uint8_t>(f::kVersion);
  out[f::kAtKind] = static_cast<uint8_t>(kind);
  put_word(&out[f::kAtCounter], counter, 4);
  for (uint32_t k = 0; k < kSessionBytes; ++k) out[f::kAtSession + k] = session[k];
  for (uint32_t k = 0; k < size; ++k) out[f::kHeadBytes + k] = body[k];
  const uint32_t covered = f::kHeadBytes + size;
  Mac mac{};
  if (!hal_.hmac_sha256(hal_.context, network_.key.data(), out.data(), covered, mac.data())) return;
  for (uint32_t k = 0; k < f::kMacBytes; ++k) out[covered + k] = mac[k];
  hal_.send_datagram(hal_.context, out.data(), covered + f::kMacBytes);
}

}  // namespace chladni
