// The emulator as a Python module. Faults and bad arguments become Python exceptions here.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "emulator/bindings/bindings.hpp"
#include "emulator/emulator.hpp"

namespace nb = nanobind;
using chladni::Config;
using chladni::emulator::Emulator;
using chladni::emulator::Flash;
using chladni::emulator::Hardware;
using chladni::emulator::PanelFaults;
using chladni::emulator::raise_if;

namespace {

chladni::ResetCause reset_cause(const std::string& name) {
  for (uint32_t k = 0; k < chladni::kResetCauses; ++k) {
    const auto cause = static_cast<chladni::ResetCause>(k);
    if (name == to_text(cause)) return cause;
  }
  throw nb::value_error("cause: power on, software, panic, watchdog, brown-out or other");
}

void check(const Hardware& hardware) {
  if (hardware.table_sectors < 1 || hardware.table_sectors > 4096) {
    throw nb::value_error("table_sectors: 1 to 4096");
  }
  const auto is_time = [](double us) { return us >= 0.0 && us <= 1e7; };
  if (!is_time(hardware.interrupt_us) || !is_time(hardware.jitter_us) ||
      !is_time(hardware.wake_us) || !is_time(hardware.erase_us) || !is_time(hardware.program_us) ||
      !is_time(hardware.restart_us) || !is_time(hardware.watchdog_us)) {
    throw nb::value_error("times: 0 to 10 s");
  }
}

Flash& area(Emulator& self, const std::string& name) {
  if (name == "tables") return self.tables();
  if (name == "config") return self.config();
  if (name == "network") return self.network();
  if (name == "boots") return self.boots();
  if (name == "effects") return self.effects();
  throw nb::value_error("area: tables, config, network, boots or effects");
}

using Duties = nb::ndarray<nb::numpy, int16_t, nb::ndim<2>>;

Duties take_duties(Emulator& self) {
  auto* record = new std::vector<int16_t>(self.pwm().take_record());
  nb::capsule owner(record, [](void* p) noexcept { delete static_cast<std::vector<int16_t>*>(p); });
  const size_t channels = self.pwm().channels();
  return Duties(record->data(), {record->size() / channels, channels}, owner);
}

// The settings of a record, by the firmware's own reader; its pins are the device's to judge.
Config parsed(const std::string& record) {
  Config config{};
  const chladni::ConfigStatus status =
      chladni::parse_settings(reinterpret_cast<const uint8_t*>(record.data()),
                              static_cast<uint32_t>(record.size()), config);
  if (status != chladni::ConfigStatus::kOk) throw nb::value_error(to_text(status));
  return config;
}

// (state, event, next state) of everything that is allowed.
std::vector<std::tuple<std::string, std::string, std::string>> transitions() {
  std::vector<std::tuple<std::string, std::string, std::string>> rows;
  for (uint32_t s = 0; s < chladni::kDeviceStates; ++s) {
    for (uint32_t e = 0; e < chladni::kDeviceEvents; ++e) {
      const auto state = static_cast<chladni::DeviceState>(s);
      const auto event = static_cast<chladni::DeviceEvent>(e);
      const chladni::Transition* const found = transition(state, event);
      if (found == nullptr) continue;
      rows.emplace_back(to_text(state), to_text(event), to_text(found->next));
    }
  }
  return rows;
}

// Frames (count, channels) into the stream's ring; how many it took.
uint32_t stream_push(Emulator& self,
                     nb::ndarray<const uint16_t, nb::ndim<2>, nb::c_contig> frames) {
  if (frames.shape(1) != self.pwm().channels())
    throw nb::value_error("frames: a column per channel");
  uint32_t taken = 0;
  while (taken < frames.shape(0) &&
         self.device().stream_push(frames.data() + taken * frames.shape(1))) {
    ++taken;
  }
  return taken;
}

bool play_live(Emulator& self, const std::vector<std::pair<int, int>>& gains,
               uint32_t frequency_millihertz, uint32_t waveform) {
  if (gains.size() != self.pwm().channels()) throw nb::value_error("gains: one pair per channel");
  if (waveform >= chladni::kWaveforms) throw nb::value_error("waveform: 0 to 3");
  chladni::Drive drive{};
  for (size_t k = 0; k < gains.size(); ++k) {
    drive[k] = {static_cast<int16_t>(gains[k].first), static_cast<int16_t>(gains[k].second)};
  }
  return self.device().play_live(drive, frequency_millihertz,
                                 static_cast<chladni::Waveform>(waveform));
}

void bind_functions(nb::module_& m) {
  m.attr("SECTOR_BYTES") = chladni::kSectorBytes;
  m.attr("STREAM_TARGET") = chladni::kStreamTarget;
  m.def("half_span_steps", &chladni::half_span_steps, nb::arg("pwm_bits"),
        "Largest amplitude of a switch's wave in duty steps.");
  m.def("full_span_steps", &chladni::full_span_steps, nb::arg("pwm_bits"), nb::arg("lost_steps"),
        "The same of a bridge.");
  m.def("lost_steps", &chladni::lost_steps, nb::arg("lost_ns"),
        "What the firmware gives back of each of a bridge's pulses.");
  m.def("phase_step_u32", &chladni::phase_step_u32, nb::arg("frequency_millihertz"),
        nb::arg("pwm_bits"), "Phase advance per sample in 2^-32 turns.");
  m.def("transitions", &transitions, "(state, event, next state) of all that is allowed.");
  m.def(
      "panel_place",
      [](nb::bytes record, uint16_t x, uint16_t y) {
        const chladni::PanelMap map(parsed({record.c_str(), record.size()}));
        const chladni::Place place = map.to_board({0, x, y});
        return std::make_tuple(place.x_um, place.y_um);
      },
      nb::arg("config"), nb::arg("x"), nb::arg("y"), "A pixel's place on the board, um.");
}

void bind_clock(nb::class_<Emulator>& emulator) {
  emulator
      .def(
          "__init__",
          [](Emulator* self, const Hardware& hardware) {
            check(hardware);
            new (self) Emulator(hardware);
          },
          nb::arg("hardware"))
      .def(
          "boot", [](Emulator& self, const std::string& cause) { self.boot(reset_cause(cause)); },
          nb::arg("cause") = "power on")
      .def(
          "run_us",
          [](Emulator& self, uint64_t us) {
            self.run_us(us);
            raise_if(self.fault());
          },
          nb::arg("microseconds"), "Advance the virtual clock; RuntimeError on a hardware fault.")
      .def(
          "finger_down",
          [](Emulator& self, uint64_t at_us, double x_mm, double y_mm, uint8_t finger) {
            self.add_finger({at_us, finger, true, x_mm, y_mm});
          },
          nb::arg("at_us"), nb::arg("x_mm"), nb::arg("y_mm"), nb::arg("finger") = 0)
      .def(
          "finger_up",
          [](Emulator& self, uint64_t at_us, uint8_t finger) {
            self.add_finger({at_us, finger, false, 0.0, 0.0});
          },
          nb::arg("at_us"), nb::arg("finger") = 0)
      .def(
          "command",
          [](Emulator& self, const std::string& line) {
            self.command(line);
            raise_if(self.fault());
          },
          nb::arg("line"));
}

void bind_wires(nb::class_<Emulator>& emulator) {
  emulator
      .def(
          "uart_write",
          [](Emulator& self, nb::bytes data) { self.uart_write({data.c_str(), data.size()}); },
          nb::arg("data"), "Bytes onto the wire to the device.")
      .def(
          "uart_read",
          [](Emulator& self) {
            const std::string bytes = self.uart_read();
            return nb::bytes(bytes.data(), bytes.size());
          },
          "Bytes that have come from the device by now.")
      .def(
          "udp_write",
          [](Emulator& self, nb::bytes data, uint32_t peer) {
            self.udp_write({peer, {data.c_str(), data.size()}});
          },
          nb::arg("data"), nb::arg("peer") = 0, "A datagram to the device, from a peer.")
      .def(
          "udp_read",
          [](Emulator& self) {
            std::vector<std::pair<uint32_t, nb::bytes>> sent;
            for (const chladni::emulator::Datagram& one : self.udp_read()) {
              sent.emplace_back(one.peer, nb::bytes(one.bytes.data(), one.bytes.size()));
            }
            return sent;
          },
          "Datagrams that the device has sent, and to whom.")
      .def(
          "set_hmac",
          [](Emulator& self, nb::callable hmac) {
            self.set_hmac([hmac](const std::string& key, const std::string& bytes) {
              const auto made = nb::cast<nb::bytes>(
                  hmac(nb::bytes(key.data(), key.size()), nb::bytes(bytes.data(), bytes.size())));
              return std::string(made.c_str(), made.size());
            });
          },
          nb::arg("hmac"), "How the device makes HMAC-SHA-256: of (key, bytes).");
}

void bind_outputs(nb::class_<Emulator>& emulator) {
  emulator
      .def("take_duties", &take_duties, "Latched duties since the last call, (periods, channels).")
      .def("stream_begin", [](Emulator& self) { return self.device().stream_begin(); })
      .def("stream_push", &stream_push, nb::arg("frames"))
      .def("stream_end", [](Emulator& self) { self.device().stream_end(); })
      .def("play_live", &play_live, nb::arg("gains"), nb::arg("frequency_millihertz"),
           nb::arg("waveform"))
      .def("update_begin", [](Emulator& self) { return self.device().update_begin(); })
      .def("update_end", [](Emulator& self) { self.device().update_end(); });
}

void bind_flash(nb::class_<Emulator>& emulator) {
  emulator
      .def(
          "erase_sector",
          [](Emulator& self, uint32_t offset, const std::string& name) {
            raise_if(area(self, name).erase_sector(offset));
          },
          nb::arg("offset"), nb::arg("area") = "tables")
      .def(
          "program",
          [](Emulator& self, uint32_t offset, nb::bytes data, const std::string& name) {
            raise_if(area(self, name)
                         .program(offset, reinterpret_cast<const uint8_t*>(data.c_str()),
                                  static_cast<uint32_t>(data.size())));
          },
          nb::arg("offset"), nb::arg("data"), nb::arg("area") = "tables")
      .def(
          "flash_bytes",
          [](Emulator& self, const std::string& name) {
            const std::vector<uint8_t>& bytes = area(self, name).bytes();
            return nb::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
          },
          nb::arg("area") = "tables")
      .def_prop_ro("flash_changes",
                   [](Emulator& self) {
                     return self.tables().changes() + self.config().changes() +
                            self.network().changes() + self.boots().changes() +
                            self.effects().changes();
                   })
      .def(
          "cut_power_after",
          [](Emulator& self, uint32_t bytes, const std::string& name) {
            area(self, name).cut_after(bytes);
          },
          nb::arg("after_bytes"), nb::arg("area") = "tables",
          "Fail in the middle of erasing or programming, after so many bytes.")
      .def("restore_power",
           [](Emulator& self) {
             self.tables().restore_power();
             self.config().restore_power();
             self.network().restore_power();
             self.effects().restore_power();
           })
      .def(
          "let_flash_lie",
          [](Emulator& self, bool does_lie, const std::string& name) {
            area(self, name).set_lying(does_lie);
          },
          nb::arg("does_lie"), nb::arg("area") = "tables")
      .def(
          "save_config",
          [](Emulator& self, nb::bytes record) {
            return std::string(to_text(self.save(parsed({record.c_str(), record.size()}))));
          },
          nb::arg("record"), "Let the firmware keep a configuration; returns its status.")
      .def(
          "parse_config",
          [](Emulator& self, nb::bytes record) {
            Config found{};
            const std::string bytes(record.c_str(), record.size());
            return std::string(
                to_text(parse_record(reinterpret_cast<const uint8_t*>(bytes.data()),
                                     static_cast<uint32_t>(bytes.size()), self.chip(), found)));
          },
          nb::arg("record"), "What the firmware says of a record.");
}

void bind_faults(nb::class_<Emulator>& emulator) {
  emulator.def("hang_main_loop", &Emulator::set_main_loop_hung, nb::arg("hung"))
      .def("delay_next_sample", &Emulator::delay_next_sample, nb::arg("microseconds"))
      .def("kill_interrupt", &Emulator::set_interrupt_dead, nb::arg("dead"))
      .def("repeat_next_sample", &Emulator::repeat_next_sample)
      .def("drop_next_duties", &Emulator::drop_next_duties, nb::arg("channels"))
      .def(
          "restart",
          [](Emulator& self, const std::string& cause) { self.restart(reset_cause(cause)); },
          nb::arg("cause"), "A reset: outputs low, and the firmware starts again after a while.")
      .def_prop_ro(
          "panel_faults", [](Emulator& self) -> PanelFaults& { return self.panel().faults(); },
          nb::rv_policy::reference_internal)
      .def("panel_register", [](Emulator& self, uint32_t at) { return self.panel().peek(at); })
      .def("panel_sees", [](Emulator& self, double x, double y) { return self.panel().sees(x, y); })
      .def("panel_power_cycle", [](Emulator& self) { self.panel().power_on(); });
}

}  // namespace

NB_MODULE(_emulator, m) {
  m.doc() = "The firmware core on a PC: virtual clock, flash, PWM outputs, a panel and fingers.";
  bind_functions(m);
  chladni::emulator::bind_hardware(m);
  chladni::emulator::bind_effects(m);
  chladni::emulator::bind_fingers(m);
  chladni::emulator::bind_synthesis(m);
  nb::class_<Emulator> emulator(m, "Emulator");
  bind_clock(emulator);
  bind_wires(emulator);
  bind_outputs(emulator);
  chladni::emulator::bind_voices(emulator);
  bind_flash(emulator);
  bind_faults(emulator);
  chladni::emulator::bind_sensing(m, emulator);
  chladni::emulator::bind_state(emulator);
}
