// The core's drives of several fingers, and what finding them costs, as Python functions.
#include <nanobind/nanobind.h>
#include <nanobind/stl/complex.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <complex>
#include <memory>
#include <tuple>
#include <vector>

#include "core/fingers/drive_solver.hpp"
#include "core/fingers/drive_solver_steps.hpp"
#include "emulator/bindings/bindings.hpp"
#include "emulator/bindings/counted_real.hpp"

namespace nb = nanobind;

namespace chladni::fingers {

template class DriveSolver<emulator::CountedReal>;

}  // namespace chladni::fingers

namespace chladni::emulator {

namespace {

using Number = std::complex<float>;
using Numbers = std::vector<Number>;
using Reals = std::vector<float>;
// Gains, means and shares, then its displacement over that of the loudest, and λ.
using Row = std::tuple<Numbers, Numbers, Reals, float, float>;
// Products, sums, and the products that were announced.
using CountRow = std::tuple<uint32_t, uint32_t, uint32_t>;

template <typename Real>
fingers::Complex<Real> number(const Number& value) {
  return {Real(value.real()), Real(value.imag())};
}

// What Python gives of a set; `points` finger by finger, point by point.
struct Given {
  uint32_t channels;
  Numbers points, own, coupling;
  Number stiffness;
  Reals levels_n, thresholds_m, regularisations;
};

template <typename Real>
void fill(const Given& given, fingers::FingerSet<Real>& set) {
  const size_t count = given.own.size();
  if (count > fingers::kMostFingers || given.channels > fingers::kMostChannels ||
      given.points.size() != count * fingers::kPoints * given.channels ||
      given.levels_n.size() != count || given.thresholds_m.size() != count ||
      given.regularisations.size() != count ||
      given.coupling.size() != given.channels * (given.channels + 1) / 2) {
    throw nb::value_error("fingers: sizes that do not fit one another");
  }
  set.channels = given.channels;
  set.count = static_cast<uint32_t>(count);
  set.stiffness = number<Real>(given.stiffness);
  auto next = given.points.begin();
  for (size_t j = 0; j < count; ++j) {
    fingers::Finger<Real>& finger = set.fingers[j];
    for (auto& point : finger.points) {
      for (uint32_t k = 0; k < given.channels; ++k) point[k] = number<Real>(*next++);
    }
    finger.own = number<Real>(given.own[j]);
    finger.level_n = Real(given.levels_n[j]);
    finger.threshold_m = Real(given.thresholds_m[j]);
    finger.regularisation = Real(given.regularisations[j]);
  }
  for (size_t k = 0; k < given.coupling.size(); ++k) {
    set.coupling[k] = number<Real>(given.coupling[k]);
  }
}

Given given(uint32_t channels, Numbers points, Numbers own, Numbers coupling, Number stiffness,
            Reals levels_n, Reals thresholds_m, Reals regularisations) {
  return {channels,  std::move(points),   std::move(own),          std::move(coupling),
          stiffness, std::move(levels_n), std::move(thresholds_m), std::move(regularisations)};
}

std::vector<Row> finger_drives(const Given& what) {
  const auto solver = std::make_unique<fingers::DriveSolver<float>>();
  fill(what, solver->set());
  if (!solver->begin()) throw nb::value_error("fingers: 1 to 10 of them, on 1 to 16 channels");
  while (solver->step()) {
  }
  std::vector<Row> rows;
  const auto plain = [](const fingers::Complex<float>& a) { return Number(a.re, a.im); };
  for (uint32_t j = 0; j < solver->set().count; ++j) {
    const fingers::FingerDrive<float>& drive = solver->drive(j);
    Numbers gains, means;
    for (uint32_t k = 0; k < what.channels; ++k) gains.push_back(plain(drive.gains[k]));
    for (uint32_t k = 0; k < what.own.size(); ++k) means.push_back(plain(drive.means[k]));
    const Reals shares(drive.shares.begin(), drive.shares.begin() + solver->set().count);
    rows.emplace_back(gains, means, shares, drive.of_loudest, drive.regularisation);
  }
  return rows;
}

std::vector<CountRow> finger_operations(const Given& what) {
  const auto solver = std::make_unique<fingers::DriveSolver<CountedReal>>();
  fill(what, solver->set());
  if (!solver->begin()) throw nb::value_error("fingers: 1 to 10 of them, on 1 to 16 channels");
  std::vector<CountRow> slices;
  for (bool goes_on = true; goes_on;) {
    CountedReal::counts = {};
    const uint32_t announced = solver->next_products();
    goes_on = solver->step();
    slices.emplace_back(CountedReal::counts.products, CountedReal::counts.sums, announced);
  }
  return slices;
}

void check_finger(uint32_t finger) {
  if (finger >= chladni::kMaxFingers) throw nb::value_error("finger: 0 to 4");
}

void set_voice(Emulator& self, uint32_t finger, uint32_t frequency_millihertz, uint32_t level_q15) {
  check_finger(finger);
  self.device().set_voice(finger, {frequency_millihertz, level_q15, false});
}

void set_signal_voice(Emulator& self, uint32_t finger, uint32_t level_q15) {
  check_finger(finger);
  self.device().set_voice(finger, {0, level_q15, true});
}

bool limit_signal(Emulator& self, uint32_t finger, uint32_t most_10nm) {
  check_finger(finger);
  return self.device().limit_signal(finger, most_10nm);
}

uint32_t push_signal(Emulator& self, uint32_t finger, const std::vector<int16_t>& samples) {
  check_finger(finger);
  uint32_t taken = 0;
  for (const int16_t sample : samples) {
    if (!self.device().signal(finger).push(sample)) break;
    ++taken;
  }
  return taken;
}

std::vector<std::tuple<bool, int32_t, int32_t, uint32_t, uint32_t>> touches(Emulator& self) {
  std::vector<std::tuple<bool, int32_t, int32_t, uint32_t, uint32_t>> found;
  const chladni::Touches touches = self.device().input().touches();
  const chladni::FingerDrives& drives = self.device().finger_drives();
  for (uint32_t s = 0; s < chladni::kMaxFingers; ++s) {
    const chladni::Contact& one = touches[s];
    found.emplace_back(one.is_down, one.place.x_um, one.place.y_um, drives.isolation(s),
                       drives.of_loudest(s));
  }
  return found;
}

}  // namespace

void bind_voices(nb::class_<Emulator>& emulator) {
  emulator
      .def("set_voice", &set_voice, nb::arg("finger"), nb::arg("frequency_millihertz"),
           nb::arg("level_q15"))
      .def("set_signal_voice", &set_signal_voice, nb::arg("finger"), nb::arg("level_q15"))
      .def("limit_signal", &limit_signal, nb::arg("finger"), nb::arg("most_10nm"))
      .def("push_signal", &push_signal, nb::arg("finger"), nb::arg("samples"),
           "So many were taken.")
      .def("touches", &touches, "(is down, x um, y um, isolation, of loudest in 1/1000) by slot.");
}

void bind_fingers(nb::module_& m) {
  nb::class_<Given>(m, "FingerSet")
      .def(
          "__init__",
          [](Given* self, uint32_t channels, Numbers points, Numbers own, Numbers coupling,
             Number stiffness, Reals levels_n, Reals thresholds_m, Reals regularisations) {
            new (self) Given(given(channels, std::move(points), std::move(own), std::move(coupling),
                                   stiffness, std::move(levels_n), std::move(thresholds_m),
                                   std::move(regularisations)));
          },
          nb::kw_only(), nb::arg("channels"), nb::arg("points"), nb::arg("own"),
          nb::arg("coupling"), nb::arg("stiffness"), nb::arg("levels_n"), nb::arg("thresholds_m"),
          nb::arg("regularisations"));
  m.def("finger_drives", &finger_drives, nb::arg("fingers"),
        "Gains, means, shares, displacement over the loudest's and λ of each finger's drive.");
  m.def("finger_operations", &finger_operations, nb::arg("fingers"),
        "Products and sums of each slice in which the drives are found.");
  m.attr("CENTRE_WEIGHT") = fingers::kCentreWeight;
  m.attr("RING_WEIGHT") = fingers::kRingWeight;
}

}  // namespace chladni::emulator
