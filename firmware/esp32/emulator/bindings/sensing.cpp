// Coils that hear each other, and what may be wrong between them and the converter.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <vector>

#include "emulator/bindings/bindings.hpp"
#include "emulator/emulator.hpp"

namespace nb = nanobind;

namespace chladni::emulator {

namespace {

using Responses = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

void set_responses(Emulator& self, const Responses& responses, double noise, double bend,
                   double begin_us, uint32_t seed) {
  const size_t channels = responses.shape(1), length = responses.shape(3);
  if (channels < 1 || channels > kMaxChannels || responses.shape(0) != channels + 1U ||
      responses.shape(2) != 4 || length < 1) {
    throw nb::value_error("responses: (channels + 1, channels, 4, duties)");
  }
  const float* const first = responses.data();
  self.coils().set_responses(static_cast<uint32_t>(channels),
                             std::vector<float>(first, first + responses.size()), noise, bend,
                             begin_us, seed);
}

}  // namespace

void bind_sensing(nb::module_& m, nb::class_<Emulator>& emulator) {
  nb::class_<SensingFaults>(m, "SensingFaults")
      .def_rw("is_expander_absent", &SensingFaults::is_expander_absent)
      .def_rw("is_converter_dead", &SensingFaults::is_converter_dead)
      .def_rw("is_pin_open", &SensingFaults::is_pin_open)
      .def_rw("stuck_address", &SensingFaults::stuck_address)
      .def_rw("lost_values", &SensingFaults::lost_values);
  emulator
      .def("set_coil_responses", &set_responses, nb::arg("responses"), nb::kw_only(),
           nb::arg("noise"), nb::arg("bend"), nb::arg("begin_us"), nb::arg("seed"),
           "What a duty makes each coil read, steps, (heard and reference, playing, conversions, "
           "duties).")
      .def_prop_ro("bridges_awake", [](Emulator& self) { return self.coils().awake(); })
      .def_prop_ro(
          "sensing_faults", [](Emulator& self) -> SensingFaults& { return self.coils().faults(); },
          nb::rv_policy::reference_internal);
}

}  // namespace chladni::emulator
