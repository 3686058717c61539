#include "core/link/link.hpp"

#include "core/link/console.hpp"

namespace chladni {

void Link::receive(const uint8_t* bytes, uint32_t count) {
  for (uint32_t k = 0; k < count; ++k) {
    switch (reader_.take(bytes[k], device_.awake_ms())) {
      case FrameReader::Found::kNothing: break;
      case FrameReader::Found::kLine: run_command(device_, reader_.line()); break;
      case FrameReader::Found::kFrame: handle_frame(); break;
    }
  }
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
