// What a host may ask, and the answers (docs/link-protocol.md), however they travel.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/device/device.hpp"
#include "core/generated/link_format.hpp"
#include "core/link/network_state.hpp"

namespace chladni {

// One host's way of asking: its last request and what was answered, in case it did not hear that.
struct Conversation {
  // An answer: kind, sequence, status, then fields and tail.
  static constexpr uint32_t kMostAnswer = 320;
  static constexpr uint32_t kNoDriver = 0xFF;

  std::array<uint8_t, kMostAnswer> answer{};
  uint32_t answer_size = 0;
  // Of the last request that was done, so that its repetition is not. Two programs may share a
  // wire and count alike, so all of a request tells it.
  uint32_t last_kind = 0;
  uint32_t last_sequence = 0;
  uint32_t last_crc = 0;
  // Of `driver_change`, for the next configuration.
  uint32_t allowed_driver = kNoDriver;
};

class Requests {
 public:
  enum class Via : uint8_t { kWire, kNetwork };

  Requests(Device& device, const NetworkState& network, Via via)
      : device_(device), network_(network), via_(via) {}

  // Kind, sequence, fields and tail of a request, in the main loop. False if it asks nothing, and
  // gets no answer. A request that is repeated is answered again and not done twice.
  // The answer is left in the conversation.
  bool take(Conversation& with, const uint8_t* bytes, uint32_t size);

 private:
  static constexpr uint32_t kAnswerHead = 3;

  struct Request {
    const uint8_t* fields;
    uint32_t size;
  };

  link_format::Status handle(uint32_t kind, const Request& request);
  link_format::Status handle_host(uint32_t kind, const Request& request);
  link_format::Status greet(const Request& request);
  link_format::Status begin_table(const Request& request);
  link_format::Status take_table(const Request& request);
  template <typename Answer>
  link_format::Status end_table(link_format::Status status);
  // Fingers (finger_requests.cpp).
  link_format::Status touch(const Request& request);
  link_format::Status touch_finger(const Request& request);
  link_format::Status lift_finger(const Request& request);
  link_format::Status set_voice(const Request& request);
  link_format::Status set_signal_voice(const Request& request);
  link_format::Status limit_signal(const Request& request);
  link_format::Status take_signal(const Request& request);
  link_format::Status put_touches();

  // Of effect banks (bank_requests.cpp).
  link_format::Status handle_bank(uint32_t kind, const Request& request);
  link_format::Status begin_bank(const Request& request);
  link_format::Status take_bank(const Request& request);
  link_format::Status end_bank();
  link_format::Status put_bank();
  link_format::Status put_area(const Request& request);
  link_format::Status put_effect(const Request& request);
  link_format::Status play_effect(const Request& request);
  link_format::Status put_finger_area(const Request& request);
  link_format::Status put_area_events(const Request& request);

  // Of coils that measure each other (sense_requests.cpp).
  link_format::Status handle_finger(uint32_t kind, const Request& request);
  link_format::Status handle_sense(uint32_t kind, const Request& request);
  link_format::Status sense(const Request& request);
  link_format::Status put_sensed();
  link_format::Status sense_motion(const Request& request);
  link_format::Status put_motion(const Request& request);

  link_format::Status select_frequency(const Request& request);
  link_format::Status select_waveform(const Request& request);
  link_format::Status allow_driver(const Request& request);
  link_format::Status set_config(const Request& request);
  link_format::Status put_info();
  link_format::Status put_reach();
  link_format::Status put_faults();
  link_format::Status put_config();
  link_format::Status put_network();
  link_format::Status set_network(const Request& request);
  link_format::Status begin_stream(const Request& request);
  link_format::Status take_stream(const Request& request);
  link_format::Status take_live(const Request& request);
  uint8_t* append(uint32_t bytes);
  template <typename Fields>
  void put(const Fields& fields) {
    write(fields, append(Fields::kBytes), Put{});
  }

  Device& device_;
  const NetworkState& network_;
  Via via_;
  Conversation* with_ = nullptr;  // whose request is being handled
};

}  // namespace chladni
