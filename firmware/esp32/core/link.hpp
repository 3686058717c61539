// The device's end of the link: requests in, answers out (docs/link-protocol.md).
#pragma once

#include <array>
#include <cstdint>

#include "core/device.hpp"
#include "core/frame.hpp"

namespace chladni {

class Link {
 public:
  explicit Link(Device& device) : device_(device) {}

  // Bytes from the wire, in the main loop. Lines of text go to the console.
  void receive(const uint8_t* bytes, uint32_t count);

  uint32_t damaged() const { return reader_.damaged(); }

 private:
  // An answer: kind, sequence, status, then fields and tail.
  static constexpr uint32_t kMostAnswer = 320;
  static constexpr uint32_t kAnswerHead = 3;

  struct Request {
    const uint8_t* fields;
    uint32_t size;
  };

  void handle_frame();
  link_format::Status handle(uint32_t kind, const Request& request);
  link_format::Status handle_table(uint32_t kind, const Request& request);
  link_format::Status handle_host(uint32_t kind, const Request& request);
  link_format::Status put_info();
  link_format::Status put_faults();
  link_format::Status put_config();
  link_format::Status take_stream(const Request& request);
  link_format::Status take_live(const Request& request);
  void put(uint32_t value, uint32_t bytes);
  void send_answer();

  Device& device_;
  FrameReader reader_;
  std::array<uint8_t, kMostAnswer> answer_{};
  uint32_t answer_size_ = 0;
  // Of the last request that was done, so that its repetition is not.
  uint32_t last_kind_ = 0;
  uint32_t last_sequence_ = 0;
  bool must_restart_ = false;
};

}  // namespace chladni
