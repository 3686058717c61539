// The drive search's kernel as a Python module. Shapes are checked here; nothing below throws.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "climb.hpp"

namespace nb = nanobind;
using chladni::kernel::Fields;
using chladni::kernel::kWindow;
using chladni::kernel::Objective;
using chladni::kernel::Ssim;

namespace {

using Planes = nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using Image = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Vector = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

struct SharedFields {
  std::shared_ptr<const Fields> fields;
};

SharedFields make_fields(const Planes& planes) {
  if (planes.shape(0) < 1 || planes.shape(1) != 2) {
    throw nb::value_error("fields: expected shape (actuators, 2, nx, ny)");
  }
  if (planes.shape(2) < kWindow || planes.shape(3) < kWindow) {
    throw nb::value_error("fields: an image holds no 7 x 7 window");
  }
  return {std::make_shared<const Fields>(planes.data(), planes.shape(0), planes.shape(2),
                                         planes.shape(3))};
}

std::vector<double> form(const Image& matrix, size_t size) {
  if (matrix.shape(0) != size || matrix.shape(1) != size) {
    throw nb::value_error("contrast: expected two matrices of 2 * actuators each way");
  }
  return std::vector<double>(matrix.data(), matrix.data() + size * size);
}

Objective make_objective(const SharedFields& shared, const Image& target, double weight_ssim,
                         double weight_contrast, const Image& inside, const Image& outside) {
  const Fields& fields = *shared.fields;
  if (target.shape(0) != fields.nx() || target.shape(1) != fields.ny()) {
    throw nb::value_error("target: expected the shape of the fields");
  }
  const size_t size = 2 * fields.count();
  std::vector<double> first, second;
  if (weight_contrast != 0.0) {
    first = form(inside, size);
    second = form(outside, size);
  }
  return Objective(Ssim(shared.fields, target.data()), weight_ssim, weight_contrast,
                   std::move(first), std::move(second));
}

void check(const Objective& self, const Vector& vector, const char* message) {
  if (vector.shape(0) != self.size()) throw nb::value_error(message);
}

}  // namespace

NB_MODULE(_kernel, module) {
  nb::class_<SharedFields>(module, "Fields")
      .def("__init__", [](SharedFields* self,
                          const Planes& planes) { new (self) SharedFields(make_fields(planes)); })
      .def_prop_ro("shape", [](const SharedFields& self) {
        return nb::make_tuple(self.fields->count(), self.fields->nx(), self.fields->ny());
      });
  nb::class_<Objective>(module, "Objective")
      .def("__init__",
           [](Objective* self, const SharedFields& fields, const Image& target, double weight_ssim,
              double weight_contrast, const Image& inside, const Image& outside) {
             new (self) Objective(
                 make_objective(fields, target, weight_ssim, weight_contrast, inside, outside));
           })
      .def_prop_ro("evaluations", &Objective::evaluations)
      .def("evaluate",
           [](Objective& self, const Vector& drive, const Vector& gradient) {
             check(self, drive, "drive: expected 2 * actuators reals");
             check(self, gradient, "gradient: expected 2 * actuators reals");
             nb::gil_scoped_release release;
             return self.evaluate(drive.data(), gradient.data());
           })
      .def("value",
           [](Objective& self, const Vector& drive) {
             check(self, drive, "drive: expected 2 * actuators reals");
             nb::gil_scoped_release release;
             return self.evaluate(drive.data(), nullptr);
           })
      .def("climb", [](Objective& self, const Vector& drive, const Matrix& curvature, size_t steps,
                       double tolerance) {
        check(self, drive, "drive: expected 2 * actuators reals");
        if (curvature.shape(0) != self.size() || curvature.shape(1) != self.size()) {
          throw nb::value_error("curvature: expected 2 * actuators each way");
        }
        nb::gil_scoped_release release;
        return chladni::kernel::climb(self, drive.data(), curvature.data(), steps, tolerance);
      });
}
