// What a host may ask, and the answers (docs/link-protocol.md), however they travel.
#pragma once

#include <array>
#include <cstdint>

#include "core/device.hpp"
#include "core/generated/link_format.hpp"

namespace chladni {

class Requests {
 public:
  // An answer: kind, sequence, status, then fields and tail.
  static constexpr uint32_t kMostAnswer = 320;

  enum class Via : uint8_t { kWire, kNetwork };

  Requests(Device& device, Via via) : device_(device), via_(via) {}

  // Kind, sequence, fields and tail of a request, in the main loop. False if it asks nothing, and
  // gets no answer. A request that is repeated is answered again and not done twice.
  bool take(const uint8_t* bytes, uint32_t size);
  const uint8_t* answer() const { return answer_.data(); }
  uint32_t answer_size() const { return answer_size_; }
  // Once the answer is out.
  void finish() const;

 private:
  static constexpr uint32_t kAnswerHead = 3;

  struct Request {
    const uint8_t* fields;
    uint32_t size;
  };

  link_format::Status handle(uint32_t kind, const Request& request);
  link_format::Status handle_table(uint32_t kind, const Request& request);
  link_format::Status handle_host(uint32_t kind, const Request& request);
  link_format::Status put_info();
  link_format::Status put_faults();
  link_format::Status put_config();
  link_format::Status put_network();
  link_format::Status set_network(const Request& request);
  link_format::Status take_stream(const Request& request);
  link_format::Status take_live(const Request& request);
  void put(uint32_t value, uint32_t bytes);

  Device& device_;
  Via via_;
  std::array<uint8_t, kMostAnswer> answer_{};
  uint32_t answer_size_ = 0;
  // Of the last request that was done, so that its repetition is not.
  uint32_t last_kind_ = 0;
  uint32_t last_sequence_ = 0;
  bool must_restart_ = false;
};

}  // namespace chladni
