#include "ssim_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

// Wide vectors where the processor has them; the compiler writes both versions.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__)
#define CHLADNI_VECTORISED __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define CHLADNI_VECTORISED
#endif

namespace chladni::kernel {

CHLADNI_VECTORISED
void sum_of_seven(const double* __restrict in, double* __restrict out, std::size_t count) {
  for (std::size_t j = 0; j < count; ++j) {
    out[j] =
        ((in[j] + in[j + 1]) + (in[j + 2] + in[j + 3])) + ((in[j + 4] + in[j + 5]) + in[j + 6]);
  }
}

CHLADNI_VECTORISED
void slide(double* __restrict sums, const double* __restrict in, const double* __restrict out,
           std::size_t count) {
  for (std::size_t j = 0; j < count; ++j) sums[j] += in[j] - out[j];
}

CHLADNI_VECTORISED
void compose_block(const Fields& fields, const double* drive, std::size_t first, std::size_t count,
                   float* __restrict real, float* __restrict imaginary,
                   float* __restrict magnitude) {
  for (std::size_t p = 0; p < count; ++p) real[p] = imaginary[p] = 0.0F;
  for (std::size_t k = 0; k < fields.count(); ++k) {
    const float a = static_cast<float>(drive[k]);
    const float b = static_cast<float>(drive[fields.count() + k]);
    const float* __restrict re = fields.real(k) + first;
    const float* __restrict im = fields.imaginary(k) + first;
    for (std::size_t p = 0; p < count; ++p) {
      real[p] += a * re[p] - b * im[p];
      imaginary[p] += a * im[p] + b * re[p];
    }
  }
  for (std::size_t p = 0; p < count; ++p) {
    magnitude[p] = std::sqrt(real[p] * real[p] + imaginary[p] * imaginary[p]);
  }
}

CHLADNI_VECTORISED
void project_row(const Fields& fields, std::size_t first, std::size_t count,
                 const float* __restrict real, const float* __restrict imaginary,
                 const float* __restrict weight, double scale, double* gradient) {
  for (std::size_t k = 0; k < fields.count(); ++k) {
    const float* __restrict re = fields.real(k) + first;
    const float* __restrict im = fields.imaginary(k) + first;
    float along = 0.0F, across = 0.0F;
    for (std::size_t p = 0; p < count; ++p) {
      along += weight[p] * (real[p] * re[p] + imaginary[p] * im[p]);
      across += weight[p] * (imaginary[p] * re[p] - real[p] * im[p]);
    }
    gradient[k] += scale * static_cast<double>(along);
    gradient[fields.count() + k] += scale * static_cast<double>(across);
  }
}

// Bits of floats that are not negative rise as they do, and those of NaN stand above all: whole
// numbers the compiler may compare many at a time.
CHLADNI_VECTORISED
Extremes extremes(const float* __restrict values, std::size_t count) {
  std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = 0;
  for (std::size_t j = 0; j < count; ++j) {
    std::int32_t bits;
    std::memcpy(&bits, values + j, sizeof bits);
    low = std::min(low, bits);
    high = std::max(high, bits);
  }
  Extremes result;
  std::memcpy(&result.low, &low, sizeof low);
  std::memcpy(&result.high, &high, sizeof high);
  return result;
}

CHLADNI_VECTORISED
void normalise(const float* __restrict magnitude, double* __restrict image, double bottom,
               double scale, std::size_t count) {
  if (!(scale > 0.0)) {
    std::fill_n(image, count, 0.0);
    return;
  }
  for (std::size_t j = 0; j < count; ++j) {
    image[j] = (static_cast<double>(magnitude[j]) - bottom) * scale;
  }
}

CHLADNI_VECTORISED
void take_in(const double* __restrict image, const double* __restrict target,
             double* __restrict kept, double* __restrict sums, std::size_t count) {
  for (std::size_t j = 0; j < count; ++j) {
    const double value = image[j], square = value * value, product = value * target[j];
    sums[j] += value - kept[j];
    sums[count + j] += square - kept[count + j];
    sums[2 * count + j] += product - kept[2 * count + j];
    kept[j] = value;
    kept[count + j] = square;
    kept[2 * count + j] = product;
  }
}

namespace {

constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;  // Wang et al. 2004, data range 1

// One window: its SSIM, and its derivatives by mean, variance and covariance.
struct Window {
  double ssim, by_mean, by_variance, by_covariance;
};

inline Window window_at(double x, double square, double product, double y, double variance_y) {
  const double variance = kSample * (square - x * x);
  const double covariance = kSample * (product - x * y);
  const double a1 = 2.0 * x * y + kC1, a2 = 2.0 * covariance + kC2;
  const double b1 = x * x + y * y + kC1, b2 = variance + variance_y + kC2;
  const double below = 1.0 / (b1 * b2);
  const double s = a1 * a2 * below;
  const double v = -s * b1 * below, c = 2.0 * a1 * below;
  return {s, 2.0 * y * a2 * below - 2.0 * x * s * (b2 * below) - kSample * (c * y + 2.0 * v * x), v,
          c};
}

}  // namespace

CHLADNI_VECTORISED
double similarity(const double* __restrict sums, const double* __restrict target_mean,
                  const double* __restrict target_variance, std::size_t count) {
  double total = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    total += window_at(sums[j] / kSamples, sums[count + j] / kSamples,
                       sums[2 * count + j] / kSamples, target_mean[j], target_variance[j])
                 .ssim;
  }
  return total;
}

CHLADNI_VECTORISED
double similarity(const double* __restrict sums, const double* __restrict target_mean,
                  const double* __restrict target_variance, double* __restrict by_mean,
                  double* __restrict by_variance, double* __restrict by_covariance,
                  std::size_t count) {
  double total = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const Window window =
        window_at(sums[j] / kSamples, sums[count + j] / kSamples, sums[2 * count + j] / kSamples,
                  target_mean[j], target_variance[j]);
    total += window.ssim;
    by_mean[j] = window.by_mean;
    by_variance[j] = window.by_variance;
    by_covariance[j] = window.by_covariance;
  }
  return total;
}

CHLADNI_VECTORISED
void slopes(const double* __restrict sums, const double* __restrict image,
            const double* __restrict target, const float* __restrict magnitude,
            float* __restrict weight, double scale, std::size_t count, std::size_t stride,
            double* total, double* by_image) {
  double sum = 0.0, moment = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const double slope = scale * (sums[j] + 2.0 * kSample * image[j] * sums[stride + j] +
                                  kSample * target[j] * sums[2 * stride + j]);
    sum += slope;
    moment += slope * image[j];
    // d|W| = Re(conj(W) dW) / |W|; where W is 0 no direction is defined, and 0 is a subgradient.
    weight[j] = magnitude[j] > 0.0F ? static_cast<float>(slope) / magnitude[j] : 0.0F;
  }
  *total += sum;
  *by_image += moment;
}

}  // namespace chladni::kernel
