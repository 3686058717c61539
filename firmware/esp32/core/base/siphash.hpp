// SipHash-2-4 of sixteen bytes: a keyed hash that costs a small part of an HMAC, for what is made
// and checked within seconds (Aumasson and Bernstein, INDOCRYPT 2012).
#pragma once

#include <array>
#include <cstdint>

namespace chladni {

class SipHash {
 public:
  using Key = std::array<uint64_t, 2>;
  using Message = std::array<uint64_t, 2>;

  static constexpr uint64_t of(const Key& key, const Message& message) {
    SipHash state(key);
    for (const uint64_t word : message) state.take(word);
    state.take(kLength);
    state.c_ ^= 0xFF;
    for (int k = 0; k < 4; ++k) state.round();
    return state.a_ ^ state.b_ ^ state.c_ ^ state.d_;
  }

 private:
  // Closes the message: its sixteen bytes in the highest byte.
  static constexpr uint64_t kLength = 16ULL << 56;

  constexpr explicit SipHash(const Key& key)
      : a_(key[0] ^ 0x736F6D6570736575ULL),
        b_(key[1] ^ 0x646F72616E646F6DULL),
        c_(key[0] ^ 0x6C7967656E657261ULL),
        d_(key[1] ^ 0x7465646279746573ULL) {}

  static constexpr uint64_t turn(uint64_t value, uint32_t bits) {
    return (value << bits) | (value >> (64U - bits));
  }
  constexpr void take(uint64_t word) {
    d_ ^= word;
    round();
    round();
    a_ ^= word;
  }
  constexpr void round() {
    a_ += b_;
    b_ = turn(b_, 13) ^ a_;
    a_ = turn(a_, 32);
    c_ += d_;
    d_ = turn(d_, 16) ^ c_;
    a_ += d_;
    d_ = turn(d_, 21) ^ a_;
    c_ += b_;
    b_ = turn(b_, 17) ^ c_;
    c_ = turn(c_, 32);
  }

  uint64_t a_, b_, c_, d_;
};

// The authors' vector for key and message 00h, 01h, … 0Fh.
static_assert(SipHash::of({0x0706050403020100ULL, 0x0F0E0D0C0B0A0908ULL},
                          {0x0706050403020100ULL, 0x0F0E0D0C0B0A0908ULL}) == 0x3F2ACC7F57C29BDBULL);

}  // namespace chladni
