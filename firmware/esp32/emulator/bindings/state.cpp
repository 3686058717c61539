// What the emulated device and its board are doing, as properties of the Python class.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "emulator/bindings/bindings.hpp"
#include "emulator/emulator.hpp"

namespace nb = nanobind;

namespace chladni::emulator {

namespace {

using FaultRow = std::tuple<std::string, uint32_t, uint32_t>;

std::vector<FaultRow> faults(const Emulator& self) {
  const FaultLog& log = self.device().faults();
  std::vector<FaultRow> rows;
  for (uint32_t k = 0; k < log.kept(); ++k) {
    const Fault& fault = log.at(k);
    rows.emplace_back(to_text(fault.cause), fault.detail, fault.at_ms);
  }
  return rows;
}

}  // namespace

void bind_state(nb::class_<Emulator>& emulator) {
  emulator.def_prop_ro("now_us", &Emulator::now_us)
      .def_prop_ro("baud", &Emulator::baud)
      .def_prop_ro("period", &Emulator::period)
      .def_prop_ro("calls", &Emulator::calls, "When the panel's line fell, carrier periods.")
      .def_prop_ro("state", [](Emulator& s) { return std::string(to_text(s.device().state())); })
      .def_prop_ro("table_status",
                   [](Emulator& s) { return std::string(to_text(s.device().table_status())); })
      .def_prop_ro("config_status",
                   [](Emulator& s) { return std::string(to_text(s.device().config_status())); })
      .def_prop_ro("panel_health",
                   [](Emulator& s) { return std::string(to_text(s.device().input().health())); })
      .def_prop_ro(
          "fade_cause",
          [](Emulator& s) { return std::string(to_text(s.device().synthesis().fade_cause())); })
      .def_prop_ro("faults", &faults, "(cause, detail, milliseconds since start), oldest first.")
      .def_prop_ro("missed_samples", [](Emulator& s) { return s.device().synthesis().missed(); })
      .def_prop_ro("limited_drives", [](Emulator& s) { return s.device().synthesis().limited(); })
      .def_prop_ro("network_port",
                   [](Emulator& s) {
                     return s.network_state().is_on ? s.network_state().port : uint16_t{0};
                   })
      .def_prop_ro("supply_ma", [](Emulator& s) { return s.device().supply().mean_ma(); })
      .def_prop_ro("stream_filled", [](Emulator& s) { return s.device().stream().filled(); })
      .def_prop_ro("stream_drift", [](Emulator& s) { return s.device().stream().drift(); })
      .def_prop_ro("coil_rise_k",
                   [](Emulator& s) {
                     std::vector<double> rises;
                     for (uint32_t k = 0; k < s.pwm().channels(); ++k) {
                       rises.push_back(s.device().heat().rise_dk(k) / 10.0);
                     }
                     return rises;
                   })
      .def_prop_ro("printed", &Emulator::printed);
}

}  // namespace chladni::emulator
