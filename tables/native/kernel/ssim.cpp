#include "ssim.hpp"

#include <algorithm>

#include "ssim_rows.hpp"

namespace chladni::kernel {
namespace {

constexpr double kFlat = 1e-6;  // a range this small beside the maximum is rounding, not a picture
constexpr std::size_t kBlock = 512;

// What an evaluation works in. A thread has one, as large as its largest image so far: an image's
// own would be cold whenever many are evaluated in turn.
struct Scratch {
  // The displacement and its magnitude at every point; the normalised image.
  std::vector<float> real, imaginary, magnitude, weight;
  std::vector<double> image;
  // Sums over seven rows of x, x^2 and x t, and derivatives by window mean, variance, covariance.
  std::vector<double> column_sums, rows, spread_sums, spread;
  // One row of windows: its sums; its derivatives between zeros, ready to be spread; and spread.
  std::vector<double> sums, padded, spread_row;

  static Scratch& of(std::size_t nx, std::size_t ny) {
    thread_local Scratch scratch;
    for (auto* plane : {&scratch.real, &scratch.imaginary, &scratch.magnitude})
      grow(plane, nx * ny);
    grow(&scratch.image, nx * ny);
    grow(&scratch.weight, ny);
    grow(&scratch.sums, 3 * ny);
    grow(&scratch.spread_row, 3 * ny);
    scratch.column_sums.assign(3 * ny, 0.0);
    scratch.spread_sums.assign(3 * ny, 0.0);
    scratch.rows.assign(3 * kWindow * ny, 0.0);
    scratch.spread.assign(3 * kWindow * ny, 0.0);
    scratch.padded.assign(3 * (ny + kPad), 0.0);
    return scratch;
  }

 private:
  template <typename Number>
  static void grow(std::vector<Number>* numbers, std::size_t count) {
    if (numbers->size() < count) numbers->resize(count);
  }
};

}  // namespace

Fields::Fields(const float* values, std::size_t count, std::size_t nx, std::size_t ny)
    : values_(values, values + 2 * count * nx * ny), count_(count), nx_(nx), ny_(ny) {}

// One evaluation of a drive.
class Ssim::Pass {
 public:
  explicit Pass(const Ssim& of)
      : ssim_(of),
        fields_(*of.fields_),
        nx_(fields_.nx()),
        ny_(fields_.ny()),
        count_(ny_ - kPad),
        scratch_(Scratch::of(nx_, ny_)) {}

  double evaluate(const double* drive, double* gradient) {
    compose(drive);
    find_range();
    if (gradient != nullptr) std::fill_n(gradient, ssim_.size(), 0.0);
    return windows(span_ > 0.0 ? gradient : nullptr);
  }

 private:
  void compose(const double* drive);
  void find_range();
  double windows(double* gradient);
  void add_row(std::size_t row);
  double window_row(std::size_t row, bool with_gradient);
  void spread_row(std::size_t row);
  void image_row(std::size_t row, double* gradient);
  void point_gradient(float magnitude, double weight, double* gradient) const;

  const Ssim& ssim_;
  const Fields& fields_;
  std::size_t nx_, ny_, count_;
  Scratch& scratch_;
  Extremes extremes_{};
  double span_ = 0.0, slope_sum_ = 0.0, slope_by_image_ = 0.0;
};

void Ssim::Pass::compose(const double* drive) {
  for (std::size_t first = 0; first < fields_.points(); first += kBlock) {
    const std::size_t count = std::min(kBlock, fields_.points() - first);
    compose_block(fields_, drive, first, count, scratch_.real.data() + first,
                  scratch_.imaginary.data() + first, scratch_.magnitude.data() + first);
  }
}

void Ssim::Pass::find_range() {
  extremes_ = extremes(scratch_.magnitude.data(), fields_.points());
  const double bottom = static_cast<double>(extremes_.low);
  const double top = static_cast<double>(extremes_.high);
  // A constant image normalises to zeros, as the metrics have it; so does one that is not finite.
  span_ = top - bottom > kFlat * top ? top - bottom : 0.0;
}

double Ssim::Pass::windows(double* gradient) {
  const std::size_t window_rows = nx_ - kPad;
  double total = 0.0;
  for (std::size_t row = 0; row < nx_ + kPad; ++row) {
    if (row < nx_) add_row(row);
    if (row >= kPad && row < nx_) total += window_row(row - kPad, gradient != nullptr);
    // A point's slope is whole once the last window that holds it is in.
    if (gradient != nullptr && row >= kPad) {
      if (row - kPad >= window_rows) spread_row(row - kPad);
      image_row(row - kPad, gradient);
    }
  }
  if (gradient != nullptr) {
    // x = (m - min) / (max - min) also moves with its extreme points.
    point_gradient(extremes_.low, (slope_by_image_ - slope_sum_) / span_, gradient);
    point_gradient(extremes_.high, -slope_by_image_ / span_, gradient);
  }
  return total / static_cast<double>(window_rows * count_);
}

void Ssim::Pass::add_row(std::size_t row) {
  double* image = scratch_.image.data() + row * ny_;
  normalise(scratch_.magnitude.data() + row * ny_, image, static_cast<double>(extremes_.low),
            span_ > 0.0 ? 1.0 / span_ : 0.0, ny_);
  take_in(image, ssim_.target_.data() + row * ny_, scratch_.rows.data() + 3 * (row % kWindow) * ny_,
          scratch_.column_sums.data(), ny_);
}

double Ssim::Pass::window_row(std::size_t row, bool with_gradient) {
  double *sums = scratch_.sums.data(), *padded = scratch_.padded.data();
  for (std::size_t k = 0; k < 3; ++k) {
    sum_of_seven(scratch_.column_sums.data() + k * ny_, sums + k * count_, count_);
  }
  const double* mean = ssim_.target_mean_.data() + row * count_;
  const double* variance = ssim_.target_variance_.data() + row * count_;
  if (!with_gradient) return similarity(sums, mean, variance, count_);
  const std::size_t stride = count_ + 2 * kPad;
  const double total = similarity(sums, mean, variance, padded + kPad, padded + stride + kPad,
                                  padded + 2 * stride + kPad, count_);
  double* spread = scratch_.spread_row.data();
  for (std::size_t k = 0; k < 3; ++k) sum_of_seven(padded + k * stride, spread + k * ny_, ny_);
  double* kept = scratch_.spread.data() + 3 * (row % kWindow) * ny_;
  slide(scratch_.spread_sums.data(), spread, kept, 3 * ny_);
  std::copy_n(spread, 3 * ny_, kept);
  return total;
}

void Ssim::Pass::spread_row(std::size_t row) {
  // Past the last windows only old rows leave.
  double* kept = scratch_.spread.data() + 3 * (row % kWindow) * ny_;
  for (std::size_t j = 0; j < 3 * ny_; ++j) {
    scratch_.spread_sums[j] -= kept[j];
    kept[j] = 0.0;
  }
}

void Ssim::Pass::image_row(std::size_t row, double* gradient) {
  const std::size_t first = row * ny_;
  const double windows = static_cast<double>((nx_ - kPad) * count_);
  slopes(scratch_.spread_sums.data(), scratch_.image.data() + first, ssim_.target_.data() + first,
         scratch_.magnitude.data() + first, scratch_.weight.data(), 1.0 / (kSamples * windows), ny_,
         ny_, &slope_sum_, &slope_by_image_);
  project_row(fields_, first, ny_, scratch_.real.data() + first, scratch_.imaginary.data() + first,
              scratch_.weight.data(), 1.0 / span_, gradient);
}

// Adds what the image's smallest or largest point contributes, of a magnitude above zero.
void Ssim::Pass::point_gradient(float magnitude, double weight, double* gradient) const {
  if (!(magnitude > 0.0F)) return;
  const float* first = scratch_.magnitude.data();
  const auto point =
      static_cast<std::size_t>(std::find(first, first + fields_.points(), magnitude) - first);
  const double scale = weight / static_cast<double>(magnitude);
  const double along = scale * static_cast<double>(scratch_.real[point]);
  const double across = scale * static_cast<double>(scratch_.imaginary[point]);
  for (std::size_t k = 0; k < fields_.count(); ++k) {
    const double re = static_cast<double>(fields_.real(k)[point]);
    const double im = static_cast<double>(fields_.imaginary(k)[point]);
    gradient[k] += along * re + across * im;
    gradient[fields_.count() + k] += across * re - along * im;
  }
}

Ssim::Ssim(std::shared_ptr<const Fields> fields, const double* target)
    : fields_(std::move(fields)), target_(target, target + fields_->points()) {
  const std::size_t nx = fields_->nx(), ny = fields_->ny(), count = ny - kPad;
  target_mean_.resize((nx - kPad) * count);
  target_variance_.resize((nx - kPad) * count);
  Scratch& scratch = Scratch::of(nx, ny);
  for (std::size_t row = 0; row < nx; ++row) {
    const double* own = target_.data() + row * ny;
    take_in(own, own, scratch.rows.data() + 3 * (row % kWindow) * ny, scratch.column_sums.data(),
            ny);
    if (row < kPad) continue;
    double* sums = scratch.sums.data();
    sum_of_seven(scratch.column_sums.data(), sums, count);
    sum_of_seven(scratch.column_sums.data() + ny, sums + count, count);
    for (std::size_t j = 0; j < count; ++j) {
      const double mean = sums[j] / kSamples;
      const std::size_t window = (row - kPad) * count + j;
      target_mean_[window] = mean;
      target_variance_[window] = kSample * (sums[count + j] / kSamples - mean * mean);
    }
  }
}

double Ssim::evaluate(const double* drive, double* gradient) {
  ++evaluations_;
  return Pass(*this).evaluate(drive, gradient);
}

}  // namespace chladni::kernel
