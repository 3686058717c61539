#include "ssim.hpp"

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
namespace {

constexpr double kSamples = static_cast<double>(kWindow * kWindow);
constexpr double kSample = kSamples / (kSamples - 1.0);  // sample variance, as scikit-image's
constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;   // Wang et al. 2004, data range 1
constexpr double kFlat = 1e-6;  // a range this small beside the maximum is rounding, not a picture
constexpr std::size_t kBlock = 512;
constexpr std::size_t kPad = kWindow - 1;

// out[j] = sum of in[j] ... in[j + 6]
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

struct Extremes {
  float low, high;
};

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

// Column sums of x, x^2 and x t with a new row in and the oldest out.
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

// The sum of one row of windows' SSIM.
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

// The same, with every window's derivatives.
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

}  // namespace

Fields::Fields(const float* values, std::size_t count, std::size_t nx, std::size_t ny)
    : values_(values, values + 2 * count * nx * ny), count_(count), nx_(nx), ny_(ny) {}

Ssim::Ssim(std::shared_ptr<const Fields> fields, const double* target)
    : fields_(std::move(fields)), target_(target, target + fields_->points()) {
  const std::size_t nx = fields_->nx(), ny = fields_->ny(), points = fields_->points();
  const std::size_t windows = (nx - kPad) * (ny - kPad);
  target_mean_.resize(windows);
  target_variance_.resize(windows);
  const std::size_t count = ny - kPad;
  std::vector<double> columns(2 * ny), sums(2 * count);
  for (std::size_t i = 0; i + kPad < nx; ++i) {
    std::fill(columns.begin(), columns.end(), 0.0);
    for (std::size_t row = i; row < i + kWindow; ++row) {
      for (std::size_t j = 0; j < ny; ++j) {
        const double value = target_[row * ny + j];
        columns[j] += value;
        columns[ny + j] += value * value;
      }
    }
    sum_of_seven(columns.data(), sums.data(), count);
    sum_of_seven(columns.data() + ny, sums.data() + count, count);
    for (std::size_t j = 0; j < count; ++j) {
      const double mean = sums[j] / kSamples;
      target_mean_[i * count + j] = mean;
      target_variance_[i * count + j] = kSample * (sums[count + j] / kSamples - mean * mean);
    }
  }
  real_.resize(points);
  imaginary_.resize(points);
  magnitude_.resize(points);
  weight_.resize(ny);
  image_.resize(points);
  column_sums_.resize(3 * ny);
  rows_.resize(3 * kWindow * ny);
  spread_.resize(3 * kWindow * ny);
  spread_sums_.resize(3 * ny);
  sums_.resize(3 * count);
  padded_.resize(3 * (count + 2 * kPad));
  spread_row_.resize(3 * ny);
}

double Ssim::evaluate(const double* drive, double* gradient) {
  ++evaluations_;
  compose(drive);
  const Range found = range();
  if (gradient != nullptr) std::fill_n(gradient, size(), 0.0);
  return windows(found, gradient);
}

void Ssim::compose(const double* drive) {
  for (std::size_t first = 0; first < fields_->points(); first += kBlock) {
    const std::size_t count = std::min(kBlock, fields_->points() - first);
    compose_block(*fields_, drive, first, count, real_.data() + first, imaginary_.data() + first,
                  magnitude_.data() + first);
  }
}

Ssim::Range Ssim::range() const {
  const Extremes found = extremes(magnitude_.data(), magnitude_.size());
  const double bottom = static_cast<double>(found.low), top = static_cast<double>(found.high);
  // A constant image normalises to zeros, as the metrics have it; so does one that is not finite.
  return {found.low, found.high, bottom, top - bottom > kFlat * top ? top - bottom : 0.0};
}

double Ssim::windows(const Range& range, double* gradient) {
  const std::size_t nx = fields_->nx(), ny = fields_->ny();
  const std::size_t window_rows = nx - kPad;
  const bool with_gradient = gradient != nullptr && range.span > 0.0;
  std::fill(column_sums_.begin(), column_sums_.end(), 0.0);
  std::fill(rows_.begin(), rows_.end(), 0.0);
  std::fill(spread_.begin(), spread_.end(), 0.0);
  std::fill(spread_sums_.begin(), spread_sums_.end(), 0.0);
  slope_sum_ = slope_by_image_ = 0.0;
  double total = 0.0;
  for (std::size_t row = 0; row < nx + kPad; ++row) {
    if (row < nx) add_row(row, range);
    if (row >= kPad && row < nx) total += window_row(row - kPad, with_gradient);
    // A point's slope is whole once the last window that holds it is in.
    if (with_gradient && row >= kPad) {
      if (row - kPad >= window_rows) spread_row(row - kPad);
      image_row(row - kPad, range, gradient);
    }
  }
  if (with_gradient) {
    // x = (m - min) / (max - min) also moves with its extreme points.
    const auto low = std::find(magnitude_.begin(), magnitude_.end(), range.low);
    const auto high = std::find(magnitude_.begin(), magnitude_.end(), range.high);
    point_gradient(static_cast<std::size_t>(low - magnitude_.begin()),
                   (slope_by_image_ - slope_sum_) / range.span, gradient);
    point_gradient(static_cast<std::size_t>(high - magnitude_.begin()),
                   -slope_by_image_ / range.span, gradient);
  }
  return total / static_cast<double>(window_rows * (ny - kPad));
}

void Ssim::add_row(std::size_t row, const Range& range) {
  const std::size_t ny = fields_->ny();
  normalise(magnitude_.data() + row * ny, image_.data() + row * ny, range.bottom,
            range.span > 0.0 ? 1.0 / range.span : 0.0, ny);
  take_in(image_.data() + row * ny, target_.data() + row * ny,
          rows_.data() + 3 * (row % kWindow) * ny, column_sums_.data(), ny);
}

double Ssim::window_row(std::size_t row, bool with_gradient) {
  const std::size_t ny = fields_->ny(), count = ny - kPad;
  for (std::size_t k = 0; k < 3; ++k) {
    sum_of_seven(column_sums_.data() + k * ny, sums_.data() + k * count, count);
  }
  const double* mean = target_mean_.data() + row * count;
  const double* variance = target_variance_.data() + row * count;
  if (!with_gradient) return similarity(sums_.data(), mean, variance, count);
  const std::size_t stride = count + 2 * kPad;
  const double total =
      similarity(sums_.data(), mean, variance, padded_.data() + kPad,
                 padded_.data() + stride + kPad, padded_.data() + 2 * stride + kPad, count);
  for (std::size_t k = 0; k < 3; ++k) {
    sum_of_seven(padded_.data() + k * stride, spread_row_.data() + k * ny, ny);
  }
  double* kept = spread_.data() + 3 * (row % kWindow) * ny;
  slide(spread_sums_.data(), spread_row_.data(), kept, 3 * ny);
  std::copy(spread_row_.begin(), spread_row_.end(), kept);
  return total;
}

void Ssim::spread_row(std::size_t row) {
  // Past the last windows only old rows leave.
  const std::size_t ny = fields_->ny();
  double* kept = spread_.data() + 3 * (row % kWindow) * ny;
  for (std::size_t j = 0; j < 3 * ny; ++j) {
    spread_sums_[j] -= kept[j];
    kept[j] = 0.0;
  }
}

void Ssim::image_row(std::size_t row, const Range& range, double* gradient) {
  const std::size_t ny = fields_->ny(), first = row * ny;
  const double windows = static_cast<double>((fields_->nx() - kPad) * (ny - kPad));
  slopes(spread_sums_.data(), image_.data() + first, target_.data() + first,
         magnitude_.data() + first, weight_.data(), 1.0 / (kSamples * windows), ny, ny, &slope_sum_,
         &slope_by_image_);
  project_row(*fields_, first, ny, real_.data() + first, imaginary_.data() + first, weight_.data(),
              1.0 / range.span, gradient);
}

void Ssim::point_gradient(std::size_t point, double weight, double* gradient) const {
  const double size = static_cast<double>(magnitude_[point]);
  if (!(size > 0.0)) return;
  const double along = weight * static_cast<double>(real_[point]) / size;
  const double across = weight * static_cast<double>(imaginary_[point]) / size;
  for (std::size_t k = 0; k < fields_->count(); ++k) {
    const double re = static_cast<double>(fields_->real(k)[point]);
    const double im = static_cast<double>(fields_->imaginary(k)[point]);
    gradient[k] += along * re + across * im;
    gradient[fields_->count() + k] += across * re - along * im;
  }
}

}  // namespace chladni::kernel
