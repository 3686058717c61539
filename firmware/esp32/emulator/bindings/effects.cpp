// The core's reader of effect banks by itself, as Python functions.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <vector>

#include "core/effects/areas.hpp"
#include "core/effects/effect_player.hpp"
#include "core/effects/low_pass.hpp"
#include "emulator/bindings/bindings.hpp"

namespace nb = nanobind;

namespace chladni::emulator {

namespace {

// Bytes as if they lay in flash, and the bank that the core finds in them.
class BankBytes {
 public:
  explicit BankBytes(const nb::bytes& given)
      : bytes_(reinterpret_cast<const uint8_t*>(given.c_str()),
               reinterpret_cast<const uint8_t*>(given.c_str()) + given.size()) {
    Hal hal{};
    hal.context = &bytes_;
    hal.map_flash = [](void* context, FlashArea, uint32_t offset,
                       uint32_t count) -> const uint8_t* {
      const auto& own = *static_cast<std::vector<uint8_t>*>(context);
      const auto size = static_cast<uint32_t>(own.size());
      return offset > size || count > size - offset ? nullptr : own.data() + offset;
    };
    // As an update does, with its header first: in flash a file has no size but that.
    const auto size = static_cast<uint32_t>(bytes_.size());
    status_ = size < bank_format::kSmallestFile ? BankStatus::kBadSize
                                                : Bank::check_head(bytes_.data(), size);
    const bool is_of_a_bank = status_ == BankStatus::kOk || status_ == BankStatus::kBadField;
    if (is_of_a_bank) status_ = bank_.load(hal, 0);
  }

  std::string status() const { return to_text(status_); }
  const Bank& whole() const {
    if (status_ != BankStatus::kOk) throw nb::value_error("no effect bank");
    return bank_;
  }

 private:
  std::vector<uint8_t> bytes_;
  Bank bank_;
  BankStatus status_ = BankStatus::kNone;
};

std::vector<float> samples(const nb::bytes& bank, uint32_t effect, uint32_t count,
                           uint32_t level_q15, bool is_held) {
  const BankBytes bytes(bank);
  if (effect >= bytes.whole().effects()) throw nb::value_error("effect: one of the bank's");
  EffectPlayer player;
  player.start(bytes.whole().effect(effect), level_q15, is_held);
  LowPass low_pass;
  std::vector<float> made(count);
  constexpr uint32_t kAtOnce = 7;  // so that parts begin and end anywhere in what is asked for
  for (uint32_t at = 0; at < count; at += kAtOnce) {
    const uint32_t left = count - at;
    player.add(made.data() + at, left < kAtOnce ? left : kAtOnce);
  }
  for (float& one : made) one = low_pass.next(one) / 32767.0F;
  return made;
}

}  // namespace

void bind_effects(nb::module_& module) {
  module.def(
      "bank_status", [](const nb::bytes& bank) { return BankBytes(bank).status(); },
      nb::arg("bank"), "What the firmware's reader says of a bank.");
  module.def("effect_samples", &samples, nb::arg("bank"), nb::arg("effect"), nb::arg("count"),
             nb::arg("level_q15") = 32767, nb::arg("is_held") = false,
             "An effect's samples as the firmware makes them, 1 for the loudest.");
  module.def(
      "area_at",
      [](const nb::bytes& bank, int32_t x_um, int32_t y_um, uint32_t before) {
        return area_at(BankBytes(bank).whole(), {x_um, y_um}, before);
      },
      nb::arg("bank"), nb::arg("x_um"), nb::arg("y_um"), nb::arg("before") = kNoArea,
      "The area of a place, 255 for none.");
}

}  // namespace chladni::emulator
