// The drive of a place: four cells around it, mixed where they lie in flash.
#include "core/table/mirrors.hpp"
#include "core/table/stored_gains.hpp"
#include "core/table/table.hpp"

namespace chladni {

namespace {

namespace f = table_format;

constexpr uint32_t kOne = 1U << f::kFractionBits;
constexpr uint32_t kNoLabel = f::kMaxLabels;  // labels lie below it

// Four corners around a place, in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
struct Mix {
  std::array<const uint8_t*, 4> records;
  std::array<uint32_t, 4> weights;        // in 1/65536; a negative one wraps around
  const std::array<uint8_t, 4>* sources;  // of the channels, up to a zero
};

// Mixes the gains of all channels that there are sources for.
//
// A function of its own, not inlined: four pointers and four weights are about all an Xtensa's
// registers hold, and a loop that spills them takes half as long again.
template <uint32_t kBits>
[[gnu::noinline]] void mix_gains(const Mix& mix, Gain* result) {
  const uint8_t *const a = mix.records[0], *const b = mix.records[1];
  const uint8_t *const c = mix.records[2], *const d = mix.records[3];
  const uint32_t u = mix.weights[0], v = mix.weights[1];
  const uint32_t w = mix.weights[2], z = mix.weights[3];
  // Sums are right modulo 2^32 and end within 2^31.
  const uint32_t zero = kZero<kBits> * (u + v + w + z);
  const std::array<uint8_t, 4>* sources = mix.sources;
  for (uint32_t first = (*sources)[0]; first != 0; first = (*++sources)[0], ++result) {
    Codes gain = codes_of<kBits>(a + first);
    uint32_t in_phase = u * gain.in_phase - zero, quadrature = u * gain.quadrature - zero;
    gain = codes_of<kBits>(b + (*sources)[1]);
    in_phase += v * gain.in_phase;
    quadrature += v * gain.quadrature;
    gain = codes_of<kBits>(c + (*sources)[2]);
    in_phase += w * gain.in_phase;
    quadrature += w * gain.quadrature;
    gain = codes_of<kBits>(d + (*sources)[3]);
    in_phase += z * gain.in_phase;
    quadrature += z * gain.quadrature;
    // Sixteen bits of weight, less those that the integers lack of Q15.
    result->in_phase_q15 = static_cast<int16_t>(static_cast<int32_t>(in_phase) >> kBits);
    result->quadrature_q15 = static_cast<int16_t>(static_cast<int32_t>(quadrature) >> kBits);
  }
}

inline void mix_gains(uint32_t bits, const Mix& mix, Gain* result) {
  if (bits == 12) {
    mix_gains<12>(mix, result);
  } else if (bits == 8) {
    mix_gains<8>(mix, result);
  } else {
    mix_gains<16>(mix, result);
  }
}

// The other sign for the corners on whose side of a mirror the label has it.
inline void turn_signs(uint32_t& w0, uint32_t& w1, uint32_t& w2, uint32_t& w3, uint32_t negations,
                       uint32_t flips, uint32_t images) {
  const uint32_t odd = negations & flips, odd_images = negations & images;
  // In both directions it is no longer odd.
  if (odd == 1 || odd == 2) {
    w0 = 0U - w0;
    w1 = 0U - w1;
    w2 = 0U - w2;
    w3 = 0U - w3;
  }
  if ((odd_images & 1U) != 0) {
    w1 = 0U - w1;
    w3 = 0U - w3;
  }
  if ((odd_images & 2U) != 0) {
    w2 = 0U - w2;
    w3 = 0U - w3;
  }
}

}  // namespace

// Records of the four cells around a place, and the weights of their values in 1/65536.
struct Table::Corners {
  std::array<const uint8_t*, 4> records;
  std::array<uint32_t, 4> weights;
  uint32_t flips;
  uint32_t images;
};

inline Table::Span Table::span(const Axis& axis, uint32_t to_next, int32_t place_um) {
  // Unsigned, so that what lies below the lower edge is beyond the upper one too.
  uint32_t from_edge = static_cast<uint32_t>(place_um) + axis.half_um, flip = 0;
  if (from_edge > axis.last_um) from_edge = place_um < 0 ? 0 : axis.last_um;
  if (from_edge > axis.fold_um) {
    from_edge = axis.last_um - from_edge;
    flip = axis.flip;
  }
  const uint32_t at = (from_edge * axis.step) >> axis.shift;
  // Beyond the outermost centres all is flat: here by holding on to them, at the other end because
  // the last cell is its own neighbour.
  const uint32_t inner = at > kOne / 2 ? at - kOne / 2 : 0;
  const uint32_t low = inner >> f::kFractionBits;
  const bool is_last = low == axis.last;
  return {low * to_next, is_last ? 0 : to_next, inner & (kOne - 1), flip,
          is_last ? axis.beyond : 0};
}

inline Table::Corners Table::corners(const uint8_t* records, const Span& x, const Span& y) {
  const uint8_t* const at0 = records + x.low + y.low;
  const uint8_t *const at1 = at0 + x.to_next, *const at2 = at0 + y.to_next;
  const uint32_t top = kOne * y.fraction, bottom = kOne * kOne - top;
  const uint32_t w1 = (bottom * x.fraction) >> f::kFractionBits;
  const uint32_t w3 = (top * x.fraction) >> f::kFractionBits;
  return {{at0, at1, at2, at1 + y.to_next},
          {bottom - w1, w1, top - w3, w3},
          x.flip | y.flip,
          x.image | y.image};
}

void Table::drive_at(Place place, Drive& result) const {
  if (records_ == nullptr) {
    result = {};
    return;
  }
  const Span y = span(y_, y_.to_next, place.y_um), x = span(x_, x_.to_next, place.x_um);
  const Corners around = corners(records_, x, y);
  const uint8_t *const at0 = around.records[0], *const at1 = around.records[1];
  const uint8_t *const at2 = around.records[2], *const at3 = around.records[3];
  uint32_t w0 = around.weights[0], w1 = around.weights[1];
  uint32_t w2 = around.weights[2], w3 = around.weights[3];
  const uint32_t flips = around.flips, images = around.images;
  const uint32_t label0 = *at0;
  uint32_t label1 = *at1, label2 = *at2, label3 = *at3;
  // An image across a cut belongs to no label.
  if ((images & 1U) != 0) {
    if (is_cut(crossings_[label1], 1)) label1 = kNoLabel;
    if (is_cut(crossings_[label3], 1)) label3 = kNoLabel;
  }
  if ((images & 2U) != 0) {
    if (is_cut(crossings_[label2], 2)) label2 = kNoLabel;
    if (label3 != kNoLabel && is_cut(crossings_[label3], 2)) label3 = kNoLabel;
  }
  uint32_t label = label0;
  if (label != label1 || label != label2 || label != label3) {
    // Only what carries the nearest corner's label takes part. Another gives its weight to the
    // corner next to it along x, or else along y, or else to the one opposite.
    const bool is_right = x.fraction >= kOne / 2;
    label = y.fraction < kOne / 2 ? (is_right ? label1 : label0) : (is_right ? label3 : label2);
    const bool is0 = label == label0, is1 = label == label1;
    const bool is2 = label == label2, is3 = label == label3;
    const uint32_t given0 = is0 ? 0 : w0, given1 = is1 ? 0 : w1;
    const uint32_t given2 = is2 ? 0 : w2, given3 = is3 ? 0 : w3;
    w0 -= given0;
    w1 -= given1;
    w2 -= given2;
    w3 -= given3;
    (is1 ? w1 : is2 ? w2 : w3) += given0;
    (is0 ? w0 : is3 ? w3 : w2) += given1;
    (is3 ? w3 : is0 ? w0 : w1) += given2;
    (is2 ? w2 : is1 ? w1 : w0) += given3;
  }
  if ((flips | images) != 0) {
    turn_signs(w0, w1, w2, w3, negations_of(crossings_[label]), flips, images);
  }
  mix_gains(bits_, {{at0, at1, at2, at3}, {w0, w1, w2, w3}, sources_[images][flips].data()},
            result.data());
}

void Table::mix_responses(Place place, Drive& coils, Gain& own) const {
  const Corners around = corners(responses_, span(x_, x_.responses_to_next, place.x_um),
                                 span(y_, y_.responses_to_next, place.y_um));
  // Sources count from a record's label, which responses do not have: from the byte before.
  Mix mix{around.records, around.weights, sources_[around.images][around.flips].data()};
  for (const uint8_t*& record : mix.records) --record;
  mix_gains(bits_, mix, coils.data());
  // It stands for itself on the other side of a mirror.
  const auto own_at = static_cast<uint8_t>(1 + actuators_ * (bits_ / 4));
  const std::array<std::array<uint8_t, 4>, 2> own_source{{{own_at, own_at, own_at, own_at}, {}}};
  mix.sources = own_source.data();
  mix_gains(bits_, mix, &own);
}

}  // namespace chladni
