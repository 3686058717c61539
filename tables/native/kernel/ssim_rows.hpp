// SSIM's arithmetic on one row of an image at a time, written for wide vectors.
#pragma once

#include <cstddef>

#include "ssim.hpp"

namespace chladni::kernel {

constexpr double kSamples = static_cast<double>(kWindow * kWindow);
constexpr double kSample = kSamples / (kSamples - 1.0);  // sample variance, as scikit-image's
constexpr std::size_t kPad = kWindow - 1;

struct Extremes {
  float low, high;
};

// out[j] = in[j] + ... + in[j + 6]
void sum_of_seven(const double* __restrict in, double* __restrict out, std::size_t count);

// sums += in - out
void slide(double* __restrict sums, const double* __restrict in, const double* __restrict out,
           std::size_t count);

// The displacement of a drive and its magnitude at `count` points from `first` on.
void compose_block(const Fields& fields, const double* drive, std::size_t first, std::size_t count,
                   float* __restrict real, float* __restrict imaginary,
                   float* __restrict magnitude);

// Adds to the gradient by a drive what the magnitudes of one row contribute, `weight` each.
void project_row(const Fields& fields, std::size_t first, std::size_t count,
                 const float* __restrict real, const float* __restrict imaginary,
                 const float* __restrict weight, double scale, double* gradient);

// The smallest and the largest of values that are not negative.
Extremes extremes(const float* __restrict values, std::size_t count);

// image = (magnitude - bottom) * scale, or zeros if the scale is.
void normalise(const float* __restrict magnitude, double* __restrict image, double bottom,
               double scale, std::size_t count);

// Column sums of x, x^2 and x t with a new row in and the oldest out.
void take_in(const double* __restrict image, const double* __restrict target,
             double* __restrict kept, double* __restrict sums, std::size_t count);

// The sum of one row of windows' SSIM.
double similarity(const double* __restrict sums, const double* __restrict target_mean,
                  const double* __restrict target_variance, std::size_t count);

// The same, with every window's derivatives.
double similarity(const double* __restrict sums, const double* __restrict target_mean,
                  const double* __restrict target_variance, double* __restrict by_mean,
                  double* __restrict by_variance, double* __restrict by_covariance,
                  std::size_t count);

// The slope of SSIM by each magnitude of a row, from the sums over the windows that hold it.
void slopes(const double* __restrict sums, const double* __restrict image,
            const double* __restrict target, const float* __restrict magnitude,
            float* __restrict weight, double scale, std::size_t count, std::size_t stride,
            double* total, double* by_image);

}  // namespace chladni::kernel
