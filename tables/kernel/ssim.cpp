#include "ssim.hpp"

#include <algorithm>
#include <cmath>

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
                 const float* __restrict weight, double* gradient) {
  for (std::size_t k = 0; k < fields.count(); ++k) {
    const float* __restrict re = fields.real(k) + first;
    const float* __restrict im = fields.imaginary(k) + first;
    float along = 0.0F, across = 0.0F;
    for (std::size_t p = 0; p < count; ++p) {
      along += weight[p] * (real[p] * re[p] + imaginary[p] * im[p]);
      across += weight[p] * (imaginary[p] * re[p] - real[p] * im[p]);
    }
    gradient[k] += static_cast<double>(along);
    gradient[fields.count() + k] += static_cast<double>(across);
  }
}

// One row of windows: the sum of their SSIM, and its derivatives by mean, variance, covariance.
CHLADNI_VECTORISED
double similarity(const double* __restrict sums, const double* __restrict target_mean,
                  const double* __restrict target_variance, double* __restrict by_mean,
                  double* __restrict by_variance, double* __restrict by_covariance,
                  std::size_t count, std::size_t stride) {
  double total = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const double x = sums[j] / kSamples, y = target_mean[j];
    const double variance = kSample * (sums[stride + j] / kSamples - x * x);
    const double covariance = kSample * (sums[2 * stride + j] / kSamples - x * y);
    const double a1 = 2.0 * x * y + kC1, a2 = 2.0 * covariance + kC2;
    const double b1 = x * x + y * y + kC1, b2 = variance + target_variance[j] + kC2;
    const double below = 1.0 / (b1 * b2);
    const double s = a1 * a2 * below;
    const double v = -s * b1 * below, c = 2.0 * a1 * below;
    total += s;
    by_variance[j] = v;
    by_covariance[j] = c;
    by_mean[j] =
        2.0 * y * a2 * below - 2.0 * x * s * (b2 * below) - kSample * (c * y + 2.0 * v * x);
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
  const auto [low, high] = std::minmax_element(magnitude_.begin(), magnitude_.end());
  const double bottom = static_cast<double>(*low), top = static_cast<double>(*high);
  // A constant image normalises to zeros, as the metrics have it; so does one that is not finite.
  const double span = top - bottom > kFlat * top ? top - bottom : 0.0;
  return {static_cast<std::size_t>(low - magnitude_.begin()),
          static_cast<std::size_t>(high - magnitude_.begin()), bottom, span};
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
    point_gradient(range.low, (slope_by_image_ - slope_sum_) / range.span, gradient);
    point_gradient(range.high, -slope_by_image_ / range.span, gradient);
  }
  return total / static_cast<double>(window_rows * (ny - kPad));
}

void Ssim::add_row(std::size_t row, const Range& range) {
  const std::size_t ny = fields_->ny();
  double* image = image_.data() + row * ny;
  const float* magnitude = magnitude_.data() + row * ny;
  const double* target = target_.data() + row * ny;
  double* kept = rows_.data() + 3 * (row % kWindow) * ny;
  const double scale = range.span > 0.0 ? 1.0 / range.span : 0.0;
  for (std::size_t j = 0; j < ny; ++j) {
    const double value =
        scale > 0.0 ? (static_cast<double>(magnitude[j]) - range.bottom) * scale : 0.0;
    const double square = value * value, product = value * target[j];
    image[j] = value;
    column_sums_[j] += value - kept[j];
    column_sums_[ny + j] += square - kept[ny + j];
    column_sums_[2 * ny + j] += product - kept[2 * ny + j];
    kept[j] = value;
    kept[ny + j] = square;
    kept[2 * ny + j] = product;
  }
}

double Ssim::window_row(std::size_t row, bool with_gradient) {
  const std::size_t ny = fields_->ny(), count = ny - kPad;
  // Windows stand at 6 ... ny - 1 of a row padded with zeros, ready to be spread.
  thread_local std::vector<double> sums, padded;
  sums.assign(3 * count, 0.0);
  padded.assign(3 * (count + 2 * kPad), 0.0);
  for (std::size_t k = 0; k < 3; ++k) {
    sum_of_seven(column_sums_.data() + k * ny, sums.data() + k * count, count);
  }
  const std::size_t stride = count + 2 * kPad;
  const double total =
      similarity(sums.data(), target_mean_.data() + row * count,
                 target_variance_.data() + row * count, padded.data() + kPad,
                 padded.data() + stride + kPad, padded.data() + 2 * stride + kPad, count, count);
  if (with_gradient) {
    thread_local std::vector<double> spread;
    spread.resize(3 * ny);
    for (std::size_t k = 0; k < 3; ++k) {
      sum_of_seven(padded.data() + k * stride, spread.data() + k * ny, ny);
    }
    double* kept = spread_.data() + 3 * (row % kWindow) * ny;
    slide(spread_sums_.data(), spread.data(), kept, 3 * ny);
    std::copy(spread.begin(), spread.end(), kept);
  }
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
  thread_local std::vector<double> part;
  part.assign(size(), 0.0);
  project_row(*fields_, first, ny, real_.data() + first, imaginary_.data() + first, weight_.data(),
              part.data());
  for (std::size_t k = 0; k < size(); ++k) gradient[k] += part[k] / range.span;
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
