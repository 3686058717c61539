// The core's only way out: what a chip, or the emulator in its place, must offer.
//
// Two contexts use it. The sample interrupt (every fourth carrier period) calls `set_duty` and
// nothing else. The main loop calls the rest. No call may block for longer than it takes to move
// its bytes.
#pragma once

#include <cstdint>

namespace chladni {

// A place on the board in micrometres from its centre: x along the short side, y along the long.
struct Place {
  int32_t x_um;
  int32_t y_um;
};

enum class Touch : uint8_t {
  kNothingNew,  // no report since the last call
  kContact,     // a finger is at the place given
  kLifted,      // the finger has left
};

struct Hal {
  void* context;  // handed back as the first argument of every call

  // Free-running microseconds; wraps around after 71 minutes.
  uint32_t (*now_us)(void* context);

  // Duty of a channel in steps of the carrier, 0 to 2^bits - 1, taken over at the next carrier
  // period. Called at most once per channel and carrier period, from the sample interrupt.
  void (*set_duty)(void* context, uint32_t channel, uint32_t duty_steps);

  // Newest report of the touch panel; fills in `place` for a contact.
  Touch (*poll_touch)(void* context, Place* place);

  // Bytes of the table partition; false if they cannot be read.
  bool (*read_table)(void* context, uint32_t offset, uint8_t* bytes, uint32_t count);

  // One line for people, without the line's end.
  void (*print)(void* context, const char* line);
};

}  // namespace chladni
