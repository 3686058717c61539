// Any bytes at the device's end of a network. A byte says how many follow in a datagram, and
// whether its MAC is made right (the fuzzers' is all zeros), so that what comes behind it is
// reached too.
#include <memory>

#include "core/link/udp.hpp"
#include "fuzz/memory_hal.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chladni;
  fuzz::Board board;
  // A network record without a flaw; what a flaw does is another input's matter.
  std::array<uint8_t, network_format::kRecordBytes> record = fuzz::network_record();
  if (size > 0 && data[0] == 0) record[size % record.size()] ^= 1U;
  std::memcpy(board.network.data(), record.data(), record.size());
  const auto device = std::make_unique<Device>();
  device->start(fuzz::make_hal(board));
  const auto datagrams = std::make_unique<Datagrams>(*device);
  datagrams->start();
  std::array<uint8_t, 256 + network_format::kMacBytes> datagram{};
  for (size_t at = 0; at < size;) {
    const uint8_t kind = data[at++];
    const size_t left = size - at, wanted = 2U * (kind & 0x7FU);
    auto count = static_cast<uint32_t>(left < wanted ? left : wanted);
    std::memcpy(datagram.data(), data + at, count);
    at += count;
    if (kind >= 128) {
      std::memset(datagram.data() + count, 0, network_format::kMacBytes);
      count += network_format::kMacBytes;
    }
    datagrams->receive(datagram.data(), count, 1);
    board.now_us += 1000;
    device->poll();
    device->sample(0);
  }
  return 0;
}
