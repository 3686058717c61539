// Complex numbers of fingers' arithmetic, without the checks for overflow that <complex> multiplies
// with. `Real` is float on the device, and a type that counts in the test of what drives cost.
#pragma once

namespace chladni::fingers {

template <typename Real>
struct Complex {
  Real re{};
  Real im{};
};

template <typename Real>
constexpr Complex<Real> conj(const Complex<Real>& a) {
  return {a.re, -a.im};
}

template <typename Real>
constexpr Complex<Real> operator+(const Complex<Real>& a, const Complex<Real>& b) {
  return {a.re + b.re, a.im + b.im};
}

template <typename Real>
constexpr Complex<Real> operator-(const Complex<Real>& a, const Complex<Real>& b) {
  return {a.re - b.re, a.im - b.im};
}

template <typename Real>
constexpr Complex<Real> operator*(const Complex<Real>& a, const Complex<Real>& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

template <typename Real>
constexpr Complex<Real> operator*(const Complex<Real>& a, Real b) {
  return {a.re * b, a.im * b};
}

template <typename Real>
constexpr Real squared(const Complex<Real>& a) {
  return a.re * a.re + a.im * a.im;
}

// sum += a b, sum −= a b, and the same with a conjugated: four multiply-accumulates each.
template <typename Real>
constexpr void add_product(Complex<Real>& sum, const Complex<Real>& a, const Complex<Real>& b) {
  sum.re = sum.re + a.re * b.re - a.im * b.im;
  sum.im = sum.im + a.re * b.im + a.im * b.re;
}

template <typename Real>
constexpr void subtract_product(Complex<Real>& sum, const Complex<Real>& a,
                                const Complex<Real>& b) {
  sum.re = sum.re - a.re * b.re + a.im * b.im;
  sum.im = sum.im - a.re * b.im - a.im * b.re;
}

}  // namespace chladni::fingers
