// SSIM of a driven board's image against a target image, with its exact gradient in the drive.
//
// The value is that of scikit-image's structural_similarity on min-max normalised images (7 x 7
// uniform window, sample variance, data range 1). Everything is linear in the fields but the last
// steps, so an evaluation is two passes over the fields and one over the windows between them.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace chladni::kernel {

constexpr std::size_t kWindow = 7;

// Fields of unit drives on an image of nx x ny points, in single precision: they should be
// orthonormal up to a scale, so that nothing is lost to cancellation between them.
class Fields {
 public:
  // `values` holds count x (real, imaginary) planes of nx * ny points.
  Fields(const float* values, std::size_t count, std::size_t nx, std::size_t ny);

  std::size_t count() const { return count_; }
  std::size_t nx() const { return nx_; }
  std::size_t ny() const { return ny_; }
  std::size_t points() const { return nx_ * ny_; }
  const float* real(std::size_t k) const { return values_.data() + 2 * k * points(); }
  const float* imaginary(std::size_t k) const { return real(k) + points(); }

 private:
  std::vector<float> values_;
  std::size_t count_, nx_, ny_;
};

// The objective over drives z of 2 * count reals, all real parts before all imaginary ones.
class Ssim {
 public:
  // `target` is a normalised image of nx * ny points.
  Ssim(std::shared_ptr<const Fields> fields, const double* target);

  std::size_t size() const { return 2 * fields_->count(); }
  std::size_t evaluations() const { return evaluations_; }

  // SSIM of a drive; writes the gradient (size() reals) unless it is null. The gradient is exact
  // where the image's smallest and largest points are single; elsewhere the value has a kink.
  double evaluate(const double* drive, double* gradient);

 private:
  class Pass;

  std::shared_ptr<const Fields> fields_;
  std::size_t evaluations_ = 0;
  std::vector<double> target_, target_mean_, target_variance_;
};

}  // namespace chladni::kernel
