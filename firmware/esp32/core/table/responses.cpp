// Responses in m/N of the integers that the lookup mixes, and the coupling as it lies in flash.
#include "core/table/responses.hpp"

#include "core/base/floats.hpp"
#include "core/table/table.hpp"

namespace chladni {

namespace {

namespace f = table_format;

// Two roundings, of the unit and of the product, as in the test against Python.
ComplexFloat times(Gain gain, uint32_t full_scale_pm) {
  const float unit =
      static_cast<float>(full_scale_pm) * (1e-12F / static_cast<float>(f::kFullScale));
  return {static_cast<float>(gain.in_phase_q15) * unit,
          static_cast<float>(gain.quadrature_q15) * unit};
}

}  // namespace

bool Table::responses_at(Place place, PlaceResponses& result) const {
  if (!has_responses()) return false;
  Drive coils{};
  Gain own{};
  mix_responses(place, coils, own);
  for (uint32_t k = 0; k < actuators_; ++k) result.coils[k] = times(coils[k], full_scale_pm_);
  result.own = times(own, read_u32(responses_head_ + f::kResponsesAtOwnFullScale));
  return true;
}

ComplexFloat Table::coupling(uint32_t one, uint32_t other) const {
  const uint32_t row = one < other ? one : other, column = one < other ? other : one;
  // Each row has one number less than the one above.
  const uint32_t before = row * actuators_ - row * (row + 1) / 2;
  const uint8_t* const at =
      responses_head_ + f::kResponsesHeadBytes + f::kCouplingBytes * (before + column);
  return {read_f32(at), read_f32(at + f::kCouplingBytes / 2)};
}

ReckonedFinger Table::finger() const {
  const uint8_t* const head = responses_head_;
  return {static_cast<float>(read_u32(head + f::kResponsesAtFullForce)) * 1e-6F,
          static_cast<float>(read_u32(head + f::kResponsesAtThreshold)) * 1e-12F,
          {read_f32(head + f::kResponsesAtStiffness),
           read_f32(head + f::kResponsesAtStiffnessImaginary)}};
}

}  // namespace chladni
