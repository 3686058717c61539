// The emulated board's parts as Python classes.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "emulator/bindings/bindings.hpp"
#include "emulator/emulator.hpp"

namespace nb = nanobind;

namespace chladni::emulator {

namespace {

PanelModel panel_model(const std::string& name) {
  if (name == "none") return PanelModel::kNone;
  if (name == "ft6x36") return PanelModel::kFt6x36;
  if (name == "gt911") return PanelModel::kGt911;
  throw nb::value_error("panel: none, ft6x36 or gt911");
}

void bind_board(nb::module_& m) {
  nb::class_<Hardware>(m, "Hardware")
      .def(nb::init<>())
      .def_prop_rw(
          "chip", [](const Hardware& self) { return static_cast<uint32_t>(self.chip); },
          [](Hardware& self, uint32_t chip) { self.chip = chip_of(chip); })
      .def_prop_rw(
          "panel", [](const Hardware& self) { return static_cast<int>(self.panel); },
          [](Hardware& self, const std::string& name) { self.panel = panel_model(name); })
      .def_rw("table_sectors", &Hardware::table_sectors)
      .def_rw("bank_sectors", &Hardware::bank_sectors)
      .def_rw("first_us", &Hardware::first_us)
      .def_rw("first_ms", &Hardware::first_ms)
      .def_rw("first_samples", &Hardware::first_samples)
      .def_rw("has_second_address", &Hardware::has_second_address)
      .def_rw("interrupt_us", &Hardware::interrupt_us)
      .def_rw("jitter_us", &Hardware::jitter_us)
      .def_rw("wake_us", &Hardware::wake_us)
      .def_rw("erase_us", &Hardware::erase_us)
      .def_rw("program_us", &Hardware::program_us)
      .def_rw("restart_us", &Hardware::restart_us)
      .def_rw("watchdog_us", &Hardware::watchdog_us)
      .def_rw("baud", &Hardware::baud)
      .def_rw("is_rested", &Hardware::is_rested)
      .def_rw("seed", &Hardware::seed);
  nb::class_<PanelFaults>(m, "PanelFaults")
      .def_rw("is_absent", &PanelFaults::is_absent)
      .def_rw("is_wedged", &PanelFaults::is_wedged)
      .def_rw("is_silent", &PanelFaults::is_silent)
      .def_rw("is_palm", &PanelFaults::is_palm)
      .def_rw("is_off_range", &PanelFaults::is_off_range)
      .def_rw("loses_next_lift", &PanelFaults::loses_next_lift)
      .def_rw("most_listed", &PanelFaults::most_listed)
      .def_rw("loses_calls", &PanelFaults::loses_calls)
      .def_rw("pulses_until_free", &PanelFaults::pulses_until_free);
}

void bind_pwm(nb::module_& m) {
  nb::class_<Pwm>(m, "Pwm")
      .def(
          "__init__",
          [](Pwm* self, uint32_t channels, uint32_t bits, bool has_signs) {
            if (channels < 1 || channels > kMaxChannels) {
              throw nb::value_error("channels: 1 to 16");
            }
            if (bits < 10 || bits > 12) throw nb::value_error("bits: 10 to 12");
            new (self) Pwm(channels, bits, has_signs);
          },
          nb::kw_only(), nb::arg("channels"), nb::arg("bits"), nb::arg("has_signs") = false)
      .def(
          "write",
          [](Pwm& self, uint64_t period, std::vector<int32_t> duties) {
            uint32_t signs = 0;
            for (size_t k = 0; k < duties.size() && k < kMaxChannels; ++k) {
              if (duties[k] < 0) signs |= 1U << k;
              duties[k] = std::abs(duties[k]);
            }
            const auto count = static_cast<uint32_t>(duties.size());
            raise_if(self.write(period, duties.data(), signs, count));
          },
          nb::kw_only(), nb::arg("period"), nb::arg("duties"));
}

}  // namespace

void bind_hardware(nb::module_& m) {
  bind_board(m);
  bind_pwm(m);
}

}  // namespace chladni::emulator
