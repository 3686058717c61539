// The core's only way out: what a chip, or the emulator in its place, must offer.
//
// Two contexts use it. The sample interrupt (every fourth carrier period) calls `set_duties` and
// nothing else. The main loop calls the rest. No call may block for longer than it takes to move
// its bytes, or to erase a sector.
#pragma once

#include <cstdint>

#include "core/generated/device_codes.hpp"
#include "core/generated/gpio.hpp"

namespace chladni {

// A place on the board in micrometres from its centre: x along the short side, y along the long.
struct Place {
  int32_t x_um;
  int32_t y_um;
};

enum class BusStatus : uint8_t {
  kOk,
  kNoAnswer,  // no device acknowledged
  kStuck,     // a line is held low, or the transfer took too long
};

enum class FlashArea : uint8_t {
  kTables,
  kConfig,   // two sectors
  kNetwork,  // one
  kBoots,    // one; a device may be without
  kEffects,  // effect banks; a device may be without
};

constexpr uint32_t kSectorBytes = 4096;
constexpr uint32_t kRetainedBytes = 208;
// In place of a count of values; and how many are kept until they are fetched, 26 ms.
constexpr uint32_t kValuesLost = UINT32_MAX, kKeptValues = 2048;

struct Hal {
  void* context;  // handed back as the first argument of every call
  gpio::Chip chip;

  // Free-running microseconds; wraps around after 71 minutes.
  uint32_t (*now_us)(void* context);

  // Duties of the configuration's channels in steps of the carrier, 0 to 2^bits - 1, taken over at
  // the next carrier period. Called at most once per carrier period, from the sample interrupt. The
  // duty of a channel that cannot take one now becomes the one that it keeps. `signs` are bits of
  // GPIO 0 to 31: the sign pins of bridges that are to be high. They follow at once, but for a
  // channel that takes no duty. None changes under a duty of more than three eighths, whose pulse
  // may last until duties are set.
  void (*set_duties)(void* context, int32_t* duties, uint32_t signs);

  // Take the gates from the PWM and hold them low, until the next start. From the main loop, when
  // the interrupt is no longer heard of.
  void (*cut_outputs)(void* context);

  // One transfer on the panel's I2C bus: write, then, if `read_count` is not 0, read.
  BusStatus (*i2c)(void* context, uint8_t address, const uint8_t* written, uint32_t write_count,
                   uint8_t* read, uint32_t read_count);
  // Clock a device that holds the data line until it lets go.
  void (*recover_bus)(void* context);
  // Whether the panel's interrupt line has fallen since the last call.
  bool (*panel_has_called)(void* context);

  // Converts the voltage of the configuration's sensing pin, 80 MHz / 2^10 times a second in step
  // with the carrier; false if it does not. Null without a converter.
  bool (*start_listening)(void* context);
  // What it has read since the last call, the oldest first, 0 to 4095, `most` at most; kValuesLost
  // if some were not fetched in time, or it has stopped.
  uint32_t (*heard)(void* context, uint16_t* values, uint32_t most);
  void (*stop_listening)(void* context);

  // Makes flash readable, before anything is read; null where it always is. It is not called after
  // too many crashes, and the calls below then fail.
  void (*open_flash)(void* context);
  // False if the bytes cannot be read, erased or programmed. A sector's offset is a multiple of
  // kSectorBytes; programming turns ones into zeros only.
  bool (*read_flash)(void* context, FlashArea area, uint32_t offset, uint8_t* bytes,
                     uint32_t count);
  // The same bytes where they lie, for good: what is erased and programmed later shows. Null if the
  // area has no such bytes. For kTables and kEffects only. Never from the sample interrupt, since
  // flash cannot be read while it is written.
  const uint8_t* (*map_flash)(void* context, FlashArea area, uint32_t offset, uint32_t count);
  bool (*erase_sector)(void* context, FlashArea area, uint32_t offset);
  bool (*program_flash)(void* context, FlashArea area, uint32_t offset, const uint8_t* bytes,
                        uint32_t count);

  // Why the processor started.
  ResetCause (*reset_cause)(void* context);

  // kRetainedBytes that outlast every reset but a loss of power; anything may lie there after one.
  uint8_t* (*retained)(void* context);

  // Bytes to the host; they may wait for the wire.
  void (*send)(void* context, const uint8_t* bytes, uint32_t count);

  // One datagram to whoever sent the one that is being handled.
  void (*send_datagram)(void* context, const uint8_t* bytes, uint32_t count);
  // HMAC-SHA-256 under a key of 32 bytes, 32 bytes long; false if there is no way to make one.
  bool (*hmac_sha256)(void* context, const uint8_t* key, const uint8_t* bytes, uint32_t count,
                      uint8_t* mac);
  // A number that cannot be foretold.
  uint32_t (*random)(void* context);

  // Bytes of the main task's stack that were never used; 0 where no one knows.
  uint32_t (*stack_free)(void* context);

  // Start again; outputs are off when it is called.
  void (*restart)(void* context);

  // One line for people, without the line's end.
  void (*print)(void* context, const char* line);
};

}  // namespace chladni
