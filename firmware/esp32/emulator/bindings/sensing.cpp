// Coils that hear each other, and what may be wrong between them and the converter.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <complex>
#include <string>
#include <vector>

#include "emulator/bindings/bindings.hpp"
#include "emulator/emulator.hpp"

namespace nb = nanobind;

namespace chladni::emulator {

namespace {

using Residues =
    nb::ndarray<const std::complex<double>, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Responses = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

void set_responses(Emulator& self, const Responses& responses, const Residues& carrier,
                   uint32_t late, double noise, double bend, double begin_us, uint32_t seed) {
  const size_t channels = responses.shape(1), length = responses.shape(3);
  if (channels < 1 || channels > kMaxChannels || responses.shape(0) != channels + 1U ||
      responses.shape(2) != 4 || length < 1) {
    throw nb::value_error("responses: (channels + 1, channels, 4, duties)");
  }
  if (carrier.shape(0) != channels + 1U || carrier.shape(1) != channels ||
      carrier.shape(2) != kHarmonics || late >= length) {
    throw nb::value_error("carrier: (channels + 1, channels, 4), late by fewer duties");
  }
  const float* const first = responses.data();
  const std::complex<double>* const left = carrier.data();
  self.coils().set_responses(static_cast<uint32_t>(channels),
                             std::vector<float>(first, first + responses.size()),
                             {left, left + carrier.size()}, late, noise, bend, begin_us, seed);
}

void bump(Emulator& self, double steps, double hz, double decay_s, double after_s) {
  const uint64_t now = self.period() << self.pwm().bits();
  self.coils().set_bump({steps, hz, decay_s, now + static_cast<uint64_t>(after_s * 80e6)});
}

using Shaken = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void set_accelerometer(Emulator& self, const std::string& model, const Shaken& responses,
                       uint8_t address, double clock_hz, double noise_g, double steady_g,
                       uint32_t seed) {
  if (responses.size() != self.coils().response_size()) {
    throw nb::value_error("responses: (channels, duties), as many as the coils' own");
  }
  MountedAccelerometer::Part part{};
  part.model = model == "ADXL345" ? AccelerometerModel::kAdxl345 : AccelerometerModel::kLis2dw12;
  part.address = address;
  part.clock_hz = clock_hz;
  part.noise_g = noise_g;
  part.steady_g = steady_g;
  part.seed = seed;
  const float* const first = responses.data();
  self.accelerometer().mount(part, std::vector<float>(first, first + responses.size()));
}

}  // namespace

void bind_sensing(nb::module_& m, nb::class_<Emulator>& emulator) {
  nb::class_<SensingFaults>(m, "SensingFaults")
      .def_rw("is_expander_absent", &SensingFaults::is_expander_absent)
      .def_rw("is_converter_dead", &SensingFaults::is_converter_dead)
      .def_rw("is_pin_open", &SensingFaults::is_pin_open)
      .def_rw("stuck_address", &SensingFaults::stuck_address)
      .def_rw("lost_values", &SensingFaults::lost_values);
  nb::class_<AccelerometerFaults>(m, "AccelerometerFaults")
      .def_rw("is_absent", &AccelerometerFaults::is_absent)
      .def_rw("is_deaf", &AccelerometerFaults::is_deaf)
      .def_rw("silent_samples", &AccelerometerFaults::silent_samples);
  emulator
      .def("set_accelerometer", &set_accelerometer, nb::arg("model"), nb::arg("responses"),
           nb::kw_only(), nb::arg("address"), nb::arg("clock_hz"), nb::arg("noise_g"),
           nb::arg("steady_g"), nb::arg("seed"),
           "What a duty does to a part that stands on the plate, g, (channels, duties), after "
           "`set_coil_responses`.")
      .def_prop_ro(
          "accelerometer_faults",
          [](Emulator& self) -> AccelerometerFaults& { return self.accelerometer().faults(); },
          nb::rv_policy::reference_internal)
      .def("set_coil_responses", &set_responses, nb::arg("responses"), nb::kw_only(),
           nb::arg("carrier"), nb::arg("late"), nb::arg("noise"), nb::arg("bend"),
           nb::arg("begin_us"), nb::arg("seed"),
           "What a duty makes each coil read, steps, (heard and reference, playing, conversions, "
           "duties), and what is left of the carrier's harmonics, (…, harmonics).")
      .def("bump", &bump, nb::kw_only(), nb::arg("steps"), nb::arg("hz"), nb::arg("decay_s"),
           nb::arg("after_s"),
           "Let a blow on the desk ring in every coil that is heard: steps of the converter.")
      .def_prop_ro("listens_at", [](Emulator& self) { return self.coils().listens_at(); })
      .def_prop_ro("bridges_awake", [](Emulator& self) { return self.coils().awake(); })
      .def_prop_ro(
          "sensing_faults", [](Emulator& self) -> SensingFaults& { return self.coils().faults(); },
          nb::rv_policy::reference_internal);
}

}  // namespace chladni::emulator
