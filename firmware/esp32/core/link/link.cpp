#include "core/link/link.hpp"

#include "core/link/console.hpp"

namespace chladni {

namespace {

// Bytes of answers on their way with which one more line is run. The longest answer of all, sixteen
// faults, is shorter than the rest of what the chip's driver keeps (chip/link/wire.hpp).
constexpr uint32_t kMostUnsent = 256;
// Half of the wire, at ten bits to a byte, is the console's.
constexpr uint32_t kBaudPerByteMs = 20000;
// By then the slowest wire has sent everything; and the fastest wire's bits fit into 32 bits.
constexpr uint32_t kAllSentMs = 4000;

}  // namespace

void Link::receive(const uint8_t* bytes, uint32_t count) {
  for (uint32_t k = 0; k < count; ++k) {
    switch (reader_.take(bytes[k], device_.awake_ms())) {
      case FrameReader::Found::kNothing: break;
      case FrameReader::Found::kLine: run_line(); break;
      case FrameReader::Found::kFrame: handle_frame(); break;
    }
  }
}

// A flood of lines must not fill the wire with answers that the main loop then waits for: what
// comes faster than half the wire takes its answers is not run.
void Link::run_line() {
  const uint32_t passed_ms = device_.now_ms() - reckoned_ms_;
  const uint32_t counted_ms = passed_ms < kAllSentMs ? passed_ms : kAllSentMs;
  const uint32_t sent = counted_ms * device_.config().link_baud / kBaudPerByteMs;
  if (sent > 0) {
    unsent_bytes_ -= sent < unsent_bytes_ ? sent : unsent_bytes_;
    reckoned_ms_ += passed_ms;
  }
  if (unsent_bytes_ < kMostUnsent) unsent_bytes_ += run_command(device_, reader_.line());
}

void Link::handle_frame() {
  if (!requests_.take(host_, reader_.bytes(), reader_.size())) return;
  send_answer();
}

// Apart, so that its buffer and what a request needs are not on the stack at once.
void Link::send_answer() const {
  constexpr uint32_t kBytes = Conversation::kMostAnswer + link_format::kCrcBytes;
  std::array<uint8_t, kBytes + kBytes / 254U + 3U> coded{};
  device_.send(coded.data(), encode_frame(host_.answer.data(), host_.answer_size, coded.data()));
}

}  // namespace chladni
