// The emulator as a Python module. Faults and bad arguments become Python exceptions here.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

#include "emulator/emulator.hpp"

namespace nb = nanobind;
using chladni::emulator::Emulator;
using chladni::emulator::EmulatorSettings;
using chladni::emulator::Pwm;

namespace {

void raise_if(const std::string& fault) {
  if (!fault.empty()) throw std::runtime_error(fault);
}

EmulatorSettings checked(uint32_t channels, uint32_t pwm_bits, double level, uint32_t panel_us,
                         uint32_t sectors) {
  if (channels < 1 || channels > chladni::kMaxChannels) throw nb::value_error("channels: 1 to 16");
  if (pwm_bits < 10 || pwm_bits > 12) throw nb::value_error("pwm_bits: 10 to 12");
  if (!(level >= 0.0 && level <= 1.0)) throw nb::value_error("level: 0 to 1");
  if (sectors < 1 || sectors > 4096) throw nb::value_error("flash_sectors: 1 to 4096");
  return {channels, pwm_bits, static_cast<uint32_t>(level * 32767.0 + 0.5), panel_us, sectors};
}

using Duties = nb::ndarray<nb::numpy, uint16_t, nb::ndim<2>>;

Duties take_duties(Emulator& self) {
  auto* record = new std::vector<uint16_t>(self.pwm().take_record());
  nb::capsule owner(record,
                    [](void* p) noexcept { delete static_cast<std::vector<uint16_t>*>(p); });
  const size_t channels = self.pwm().channels();
  return Duties(record->data(), {record->size() / channels, channels}, owner);
}

}  // namespace

NB_MODULE(_emulator, m) {
  m.doc() = "The firmware core on a PC: virtual clock, flash, PWM outputs and a finger.";
  m.attr("SECTOR_BYTES") = chladni::emulator::kSectorBytes;
  m.def("half_span_steps", &chladni::half_span_steps, nb::arg("pwm_bits"),
        "Largest amplitude of an output in duty steps.");
  m.def("phase_step_u32", &chladni::phase_step_u32, nb::arg("frequency_mhz"), nb::arg("pwm_bits"),
        "Phase advance per sample in 2^-32 turns.");
  nb::class_<Pwm>(m, "Pwm")
      .def(
          "__init__",
          [](Pwm* self, uint32_t channels, uint32_t bits) {
            const EmulatorSettings ok = checked(channels, bits, 0.0, 0, 1);
            new (self) Pwm(ok.channels, ok.pwm_bits);
          },
          nb::kw_only(), nb::arg("channels"), nb::arg("bits"))
      .def(
          "write",
          [](Pwm& self, uint64_t period, uint32_t channel, uint32_t duty) {
            raise_if(self.write(period, channel, duty));
          },
          nb::kw_only(), nb::arg("period"), nb::arg("channel"), nb::arg("duty"));
  nb::class_<Emulator>(m, "Emulator")
      .def(
          "__init__",
          [](Emulator* self, uint32_t channels, uint32_t bits, double level, uint32_t panel_us,
             uint32_t sectors) {
            new (self) Emulator(checked(channels, bits, level, panel_us, sectors));
          },
          nb::kw_only(), nb::arg("channels"), nb::arg("pwm_bits"), nb::arg("level"),
          nb::arg("panel_period_us"), nb::arg("flash_sectors"))
      .def(
          "boot", [](Emulator& self) { return std::string(chladni::to_text(self.boot())); },
          "Power on; returns the table's status.")
      .def(
          "run_us",
          [](Emulator& self, uint64_t us) {
            self.run_us(us);
            raise_if(self.fault());
          },
          nb::arg("microseconds"), "Advance the virtual clock; RuntimeError on a hardware fault.")
      .def(
          "finger_down",
          [](Emulator& self, uint64_t at_us, int32_t x_um, int32_t y_um) {
            self.add_finger({at_us, true, {x_um, y_um}});
          },
          nb::arg("at_us"), nb::arg("x_um"), nb::arg("y_um"))
      .def(
          "finger_up",
          [](Emulator& self, uint64_t at_us) { self.add_finger({at_us, false, {0, 0}}); },
          nb::arg("at_us"))
      .def("hang_main_loop", &Emulator::set_main_loop_hung, nb::arg("hung"))
      .def("silence_panel", &Emulator::set_panel_silent, nb::arg("silent"))
      .def("lose_next_lift", &Emulator::lose_next_lift)
      .def(
          "command",
          [](Emulator& self, const std::string& line) {
            self.command(line);
            raise_if(self.fault());
          },
          nb::arg("line"))
      .def(
          "erase_sector",
          [](Emulator& self, uint32_t offset) { raise_if(self.flash().erase_sector(offset)); },
          nb::arg("offset"))
      .def(
          "program",
          [](Emulator& self, uint32_t offset, nb::bytes data) {
            raise_if(self.flash().program(offset, reinterpret_cast<const uint8_t*>(data.c_str()),
                                          static_cast<uint32_t>(data.size())));
          },
          nb::arg("offset"), nb::arg("data"))
      .def("take_duties", &take_duties, "Latched duties since the last call, (periods, channels).")
      .def_prop_ro("flash_bytes", [](Emulator& self) { return self.flash().size(); })
      .def_prop_ro("now_us", &Emulator::now_us)
      .def_prop_ro(
          "state",
          [](const Emulator& self) { return std::string(chladni::to_text(self.device().state())); })
      .def_prop_ro("fade_cause",
                   [](const Emulator& self) {
                     return std::string(chladni::to_text(self.device().fade_cause()));
                   })
      .def_prop_ro("printed", &Emulator::printed);
}
