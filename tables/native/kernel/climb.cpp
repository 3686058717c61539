#include "climb.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace chladni::kernel {
namespace {

using Vector = std::vector<double>;

constexpr double kDecrease = 1e-4, kCurvature = 0.9;  // Nocedal and Wright, section 3.1
constexpr int kTrials = 25;
constexpr double kFirstStep = 0.1;  // of the drive's own length, while no curvature is known

double dot(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// direction = -H g
Vector descent(const double* curvature, const Vector& slope) {
  const std::size_t n = slope.size();
  Vector result(n);
  for (std::size_t i = 0; i < n; ++i) {
    result[i] = -std::inner_product(slope.begin(), slope.end(), curvature + i * n, 0.0);
  }
  return result;
}

void set_identity(double* curvature, std::size_t n, double scale) {
  std::fill_n(curvature, n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) curvature[i * n + i] = scale;
}

// H <- (1 - s y'/r) H (1 - y s'/r) + s s'/r with r = s'y
void update(double* curvature, const Vector& step, const Vector& change) {
  const std::size_t n = step.size();
  const double r = dot(step, change);
  Vector hy(n);
  for (std::size_t i = 0; i < n; ++i) {
    hy[i] = std::inner_product(change.begin(), change.end(), curvature + i * n, 0.0);
  }
  const double factor = (1.0 + dot(change, hy) / r) / r;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      curvature[i * n + j] += factor * step[i] * step[j] - (hy[i] * step[j] + step[i] * hy[j]) / r;
    }
  }
}

// A point on the way: the loss (less is better) and its slope.
struct Place {
  Vector drive, slope;
  double loss = 0.0;
};

void look(Objective& objective, Place& place) {
  place.loss = -objective.evaluate(place.drive.data(), place.slope.data());
  for (double& value : place.slope) value = -value;
}

// Finds a step along `direction` that keeps the weak Wolfe conditions, or at least descends.
bool search(Objective& objective, const Place& from, const Vector& direction, double along,
            double step, Place& to) {
  const std::size_t n = direction.size();
  double shortest = 0.0, longest = std::numeric_limits<double>::infinity();
  Place best = from;
  for (int trial = 0; trial < kTrials; ++trial) {
    for (std::size_t i = 0; i < n; ++i) to.drive[i] = from.drive[i] + step * direction[i];
    look(objective, to);
    const bool descends = to.loss <= from.loss + kDecrease * step * along;
    if (to.loss < best.loss) best = to;
    if (descends && dot(to.slope, direction) >= kCurvature * along) return true;
    if (!descends) {
      longest = step;
      // Where the parabola through both ends has its foot, if that lies well inside.
      const double bend = to.loss - from.loss - along * step;
      const double foot = bend > 0.0 ? -along * step * step / (2.0 * bend) : 0.0;
      step = std::clamp(foot, shortest + 0.1 * (longest - shortest),
                        shortest + 0.5 * (longest - shortest));
    } else {
      shortest = step;
      step = std::isfinite(longest) ? 0.5 * (shortest + longest) : 2.0 * step;
    }
    if (std::isfinite(longest) && longest - shortest < 1e-9 * longest) break;
  }
  to = std::move(best);
  return to.loss < from.loss;
}

}  // namespace

Objective::Objective(Ssim ssim, double weight_ssim, double weight_contrast, Vector inside,
                     Vector outside)
    : ssim_(std::move(ssim)),
      weight_ssim_(weight_ssim),
      weight_contrast_(weight_contrast),
      inside_(std::move(inside)),
      outside_(std::move(outside)),
      product_(ssim_.size()) {}

double Objective::evaluate(const double* drive, double* gradient) {
  double value = weight_ssim_ * ssim_.evaluate(drive, gradient);
  if (gradient != nullptr) {
    for (std::size_t i = 0; i < size(); ++i) gradient[i] *= weight_ssim_;
  }
  if (weight_contrast_ != 0.0 && !inside_.empty()) {
    value += add_form(inside_, drive, 1.0, gradient) + add_form(outside_, drive, -1.0, gradient);
  }
  return value;
}

// sign * weight * ln(z'Az), with its gradient added.
double Objective::add_form(const Vector& form, const double* drive, double sign, double* gradient) {
  const std::size_t n = size();
  double value = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    product_[i] = std::inner_product(drive, drive + n, form.data() + i * n, 0.0);
    value += product_[i] * drive[i];
  }
  const double scale = sign * weight_contrast_;
  value = std::max(value, std::numeric_limits<double>::min());
  if (gradient != nullptr) {
    for (std::size_t i = 0; i < n; ++i) gradient[i] += scale * 2.0 * product_[i] / value;
  }
  return scale * std::log(value);
}

double climb(Objective& objective, double* drive, double* curvature, std::size_t steps,
             double tolerance) {
  const std::size_t n = objective.size();
  Place here{Vector(drive, drive + n), Vector(n)};
  Place next{Vector(n), Vector(n)};
  look(objective, here);
  bool is_fresh = curvature[0] == 0.0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double steepness = std::sqrt(dot(here.slope, here.slope));
    if (!(steepness > 0.0)) break;
    if (is_fresh) {
      const double length = std::sqrt(dot(here.drive, here.drive));
      set_identity(curvature, n, kFirstStep * length / steepness);
    }
    Vector direction = descent(curvature, here.slope);
    double along = dot(direction, here.slope);
    if (!(along < 0.0)) {  // rounding has spoilt the curvature: begin again
      is_fresh = true;
      set_identity(curvature, n, 1.0 / steepness);
      direction = descent(curvature, here.slope);
      along = dot(direction, here.slope);
    }
    if (-along < tolerance && !is_fresh) break;
    if (!search(objective, here, direction, along, 1.0, next)) break;
    Vector step(n), change(n);
    for (std::size_t i = 0; i < n; ++i) {
      step[i] = next.drive[i] - here.drive[i];
      change[i] = next.slope[i] - here.slope[i];
    }
    const double agreement = dot(step, change);
    if (agreement > 1e-12 * std::sqrt(dot(step, step) * dot(change, change))) {
      if (is_fresh) set_identity(curvature, n, agreement / dot(change, change));
      update(curvature, step, change);
      is_fresh = false;
    }
    std::swap(here, next);
  }
  std::copy(here.drive.begin(), here.drive.end(), drive);
  return -here.loss;
}

}  // namespace chladni::kernel
