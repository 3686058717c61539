// A panel that says anything, in every mounting: places stay numbers, and time goes on.
#include "core/touch/touch_input.hpp"
#include "fuzz/memory_hal.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chladni;
  if (size < 8) return -1;
  fuzz::Board board;
  board.bus = data + 4;
  board.bus_size = size - 4;
  Config config{};
  config.panel = static_cast<uint8_t>(1 + data[0] % 3);
  config.panel_turns = data[1] & 3U;
  config.panel_mirrored = (data[1] >> 2) & 1U;
  config.interrupt_pin = (data[1] & 8U) != 0 ? 34 : 255;
  config.press_reports = static_cast<uint8_t>(1 + data[2] % 8);
  config.lift_hold_ms = data[3];
  const Hal hal = fuzz::make_hal(board);
  TouchInput input;
  input.start(config, 100000);
  for (size_t k = 0; k < 4 * size; ++k) {
    const TouchEvent event = input.poll(hal, board.now_us);
    // On the panel, and so on the board: it is 66 mm by 132 mm about the middle.
    if (event.place.x_um > 66001 || event.place.x_um < -66001) __builtin_trap();
    if (event.place.y_um > 66001 || event.place.y_um < -66001) __builtin_trap();
    board.now_us += 1000U * (1U + board.next() % 16U);
  }
  return 0;
}
