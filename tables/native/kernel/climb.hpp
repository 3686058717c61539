// Quasi-Newton ascent (BFGS) of the objective over a drive, with the curvature handed in and out.
#pragma once

#include <cstddef>
#include <vector>

#include "ssim.hpp"

namespace chladni::kernel {

// weight_ssim * SSIM + weight_contrast * ln(contrast), where contrast is a ratio of quadratic forms
// of the drive (mean square in the target's disc over mean square on the rest).
class Objective {
 public:
  // `inside` and `outside` are symmetric matrices of size x size reals, or empty without contrast.
  Objective(Ssim ssim, double weight_ssim, double weight_contrast, std::vector<double> inside,
            std::vector<double> outside);

  std::size_t size() const { return ssim_.size(); }
  std::size_t evaluations() const { return ssim_.evaluations(); }
  double evaluate(const double* drive, double* gradient);

 private:
  double add_form(const std::vector<double>& form, const double* drive, double sign,
                  double* gradient);

  Ssim ssim_;
  double weight_ssim_, weight_contrast_;
  std::vector<double> inside_, outside_, product_;
};

// Climbs from `drive` in place and returns the value reached.
//
// `curvature` is the inverse Hessian of the loss, size x size: zeros mean that nothing is known
// yet. It is updated, so that a climb on a finer image starts where the coarser one ended. The
// climb ends after `steps`, or when a step promises less than `tolerance`. The line search keeps
// to the weak Wolfe conditions by bisection, which stays sound at the kinks that min-max
// normalising makes (Lewis and Overton 2013).
double climb(Objective& objective, double* drive, double* curvature, std::size_t steps,
             double tolerance);

}  // namespace chladni::kernel
