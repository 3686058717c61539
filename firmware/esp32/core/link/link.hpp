// The device's end of the wire: frames in, answers out, and lines of text to the console.
#pragma once

#include <cstdint>

#include "core/link/framing.hpp"
#include "core/link/requests.hpp"

namespace chladni {

class Link {
 public:
  Link(Device& device, const NetworkState& network)
      : device_(device), requests_(device, network, Requests::Via::kWire) {}

  // Bytes from the wire, in the main loop.
  void receive(const uint8_t* bytes, uint32_t count);

  uint32_t damaged() const { return reader_.damaged(); }

 private:
  void handle_frame();
  void run_line();
  void send_answer() const;

  Device& device_;
  Requests requests_;
  Conversation host_;
  FrameReader reader_;
  // Of the console's answers, what the wire has not had time for, and when that was reckoned.
  uint32_t unsent_bytes_ = 0;
  uint32_t reckoned_ms_ = 0;
};

}  // namespace chladni
