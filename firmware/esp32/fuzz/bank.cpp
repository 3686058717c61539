// Any bytes as an effect bank whose CRC is right: what the device takes in, it plays without harm.
#include <memory>

#include "core/base/crc32.hpp"
#include "core/effects/finger_effects.hpp"
#include "fuzz/memory_hal.hpp"

namespace {

using namespace chladni;

// A finger goes over the board, comes back and leaves, and every sample that it has is made.
void touch_all(const Bank& bank) {
  const auto effects = std::make_unique<FingerEffects>();
  const auto ring = std::make_unique<SignalRing>();
  effects->start(bank);
  uint32_t now_ms = 0;
  const auto turn = [&](const Touches& touches) {
    effects->follow(touches, 0xFFU, ++now_ms);
    ring->begin();  // as if all had been taken
    effects->render(0, *ring);
  };
  for (int32_t k = 0; k < 200; ++k) {
    Touches touches{};
    touches[0] = {k % 50 != 49, {(k * 7919) % 90000 - 45000, (k * 104729) % 180000 - 90000}};
    turn(touches);
  }
  for (uint32_t k = 0; k < bank.effects(); ++k) {
    EffectPlayer player;
    std::array<float, 64> samples{};
    player.start(bank.effect(k), 32767, true);
    for (uint32_t n = 0; n < 40; ++n) player.add(samples.data(), samples.size());
    player.start(bank.effect(k), 32767, false);
    for (uint32_t n = 0; n < 40; ++n) player.add(samples.data(), samples.size());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < bank_format::kSmallestFile || size > bank_format::kLargestFile) return -1;
  fuzz::Board board;
  std::memcpy(board.effects.data(), data, size);
  // The header says how long it is; the CRC belongs there.
  uint32_t total = 0;
  std::memcpy(&total, data + bank_format::kAtTotalBytes, 4);
  if (total >= 4 && total <= bank_format::kLargestFile) {
    const uint32_t crc = crc32(board.effects.data(), total - 4);
    std::memcpy(board.effects.data() + total - 4, &crc, 4);
  }
  const Hal hal = fuzz::make_hal(board);
  const auto bank = std::make_unique<Bank>();
  if (bank->load(hal, 0) == BankStatus::kOk) touch_all(*bank);
  return 0;
}
