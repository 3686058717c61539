// Any bytes at the device's end of the link; and any payloads, framed as they must be. A byte says
// which: below 128 what follows up to its count goes onto the wire as it is, else as a frame.
#include <memory>

#include "core/link/link.hpp"
#include "fuzz/memory_hal.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chladni;
  fuzz::Board board;
  const auto device = std::make_unique<Device>();
  device->start(fuzz::make_hal(board));
  const NetworkState network;
  const auto link = std::make_unique<Link>(*device, network);
  std::array<uint8_t, link_format::kMaxFrame * 2> coded{};
  for (size_t at = 0; at < size;) {
    const uint8_t kind = data[at++];
    const size_t left = size - at, wanted = kind & 0x7FU;
    const auto count = static_cast<uint32_t>(left < wanted ? left : wanted);
    if (kind < 128) {
      link->receive(data + at, count);
    } else {
      link->receive(coded.data(), encode_frame(data + at, count, coded.data()));
    }
    at += count;
    board.now_us += 1000;
    device->poll();
    device->sample(0);
  }
  return 0;
}
