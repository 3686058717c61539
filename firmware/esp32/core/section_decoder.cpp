#include "core/section_decoder.hpp"

namespace chladni {

namespace {

namespace f = table_format;
using Status = StreamReader::Status;

constexpr uint16_t kNone = 0xFFFF;
// What the stream says of a label and a mirror; 1 is joined.
constexpr uint32_t kCut = 0, kNegated = 2;
constexpr uint32_t kMaxRunBits = 16;
// A difference of twice full scale in zigzag takes so many bits.
constexpr uint32_t kCodeBits = 18;
// One of this many bits is at most 8192. From a mean within full scale no sum of squares then gets
// to where `fill` could not tell; so it is with nearly all regions.
constexpr uint32_t kSmallBits = 14;
static_assert(kSmallBits >= table_format::kMaxShift, "no shift by a negative number");

// Bit f: what holds for the flips f.
uint8_t by_flips(bool in_x, bool in_y, bool in_both) {
  return static_cast<uint8_t>((in_x ? 2U : 0U) + (in_y ? 4U : 0U) + (in_both ? 8U : 0U));
}

uint32_t bits_below(uint32_t count) {
  uint32_t width = 0;
  while (((count - 1U) >> width) != 0) ++width;
  return width;
}

// Labels as they are expected: the one above; but where the one left of that is the same, the one
// to the left.
void expect_labels(uint8_t* own, uint32_t count, bool has_left, bool has_above, uint32_t pitch) {
  uint8_t* const end = own + count;
  if (!has_above) {
    const uint8_t left = has_left ? own[-1] : uint8_t{0};
    while (own != end) *own++ = left;
    return;
  }
  const uint8_t* above = own - pitch;
  if (!has_left) *own++ = *above++;
  if (own == end) return;
  uint8_t left = own[-1], upper_left = above[-1];
  while (own != end) {
    const uint8_t upper = *above++;
    if (upper != upper_left) left = upper;
    *own++ = left;
    upper_left = upper;
  }
}

uint32_t read_run(StreamReader& stream) {
  const uint32_t length = stream.unary();
  if (length > kMaxRunBits) {
    stream.fail(Status::kDamaged);
    return 0;
  }
  return (1U << length) + stream.number(length) - 1U;
}

void read_labels(StreamReader& stream, const SectionShape& shape, SectionDrives& drives) {
  const uint32_t width = bits_below(shape.labels);
  uint32_t run = read_run(stream);
  for (uint32_t row = 0; row < shape.rows; ++row) {
    uint8_t* const own = drives.labels.data() + row * shape.pitch;
    for (uint32_t column = 0; column < shape.columns;) {
      if (run != 0) {
        const uint32_t left = shape.columns - column, count = run < left ? run : left;
        expect_labels(own + column, count, column != 0, row != 0, shape.pitch);
        column += count;
        run -= count;
        continue;
      }
      const uint32_t label = stream.number(width);
      if (label >= shape.labels) stream.fail(Status::kDamaged);
      own[column++] = static_cast<uint8_t>(label);
      run = read_run(stream);
      if (stream.status() != Status::kOk) return;
    }
  }
  if (run != 0) stream.fail(Status::kDamaged);
}

// Parameters of the Rice codes.
struct Rates {
  uint32_t shift;
  StreamReader::RiceWidths rice;
};

void step(StreamReader& stream, uint32_t& value, uint32_t largest) {
  const int32_t moved = static_cast<int32_t>(value) + from_zigzag(stream.unary());
  if (moved < 0 || moved > static_cast<int32_t>(largest)) {
    stream.fail(Status::kDamaged);
    return;
  }
  value = static_cast<uint32_t>(moved);
}

// Where a region's neighbours are that were decoded before it, for all regions of a pass.
struct Pass {
  std::array<int32_t, 4> regions;  // from the region itself
  int32_t distance;                // along a column or a row
  // Bit n: neighbour n lies on this side, and is there only if the side is.
  uint32_t all, left, right, below, above;
};

Pass nearest_before(int32_t distance, int32_t pitch) {
  const int32_t up = distance * pitch;
  return {{-up, -distance, 0, 0}, distance, 0b0011, 0b0010, 0, 0b0001, 0};
}

Pass at_corners(int32_t distance, int32_t pitch) {
  const int32_t up = distance * pitch;
  return {{-up - distance, -up + distance, up - distance, up + distance},
          distance,
          0b1111,
          0b0101,
          0b1010,
          0b0011,
          0b1100};
}

Pass beside_and_above(int32_t distance, int32_t pitch) {
  const int32_t up = distance * pitch;
  return {{-up, -distance, distance, up}, distance, 0b1111, 0b0010, 0b0100, 0b0001, 0b1000};
}

// What a region differs by from its prediction.
enum class Differences : uint8_t { kNone, kSmall, kAny };

constexpr std::array<Gain, f::kMaxActuators> kSilence{};

class Decoder {
 public:
  Decoder(StreamReader& stream, const SectionShape& shape, SectionDrives& drives)
      : stream_(stream), shape_(shape), drives_(drives), rates_{shape.start_shift, {}} {
    rates_.rice.fill(f::kStartRice);
    for (uint32_t label = 0; label < shape.labels; ++label) drives_.latest[label] = kNone;
  }

  void decode_all() {
    const auto columns = static_cast<int32_t>(shape_.columns);
    const auto rows = static_cast<int32_t>(shape_.rows);
    const auto pitch = static_cast<int32_t>(shape_.pitch);
    const int32_t larger = columns > rows ? columns : rows;
    int32_t span = 1;
    while (span < static_cast<int32_t>(f::kCoarsest) && span < larger) span *= 2;
    start(nearest_before(span, pitch));
    for (int32_t row = 0; row < rows; row += span) decode_row(row, 0, span);
    for (; span > 1; span /= 2) {
      const int32_t half = span / 2;
      start(at_corners(half, pitch));
      for (int32_t row = half; row < rows; row += span) decode_row(row, half, span);
      start(beside_and_above(half, pitch));
      bool is_on_row = true;  // of the coarser level: only every second is missing
      for (int32_t row = 0; row < rows; row += half) {
        decode_row(row, is_on_row ? half : 0, span);
        is_on_row = !is_on_row;
      }
    }
  }

 private:
  void start(const Pass& pass) {
    pass_ = pass;
    for (uint32_t n = 0; n < 4; ++n) {
      gains_to_[n] = pass.regions[n] * static_cast<int32_t>(shape_.actuators);
    }
  }

  void decode_row(int32_t row, int32_t column, int32_t step) {
    const auto columns = static_cast<int32_t>(shape_.columns);
    const int32_t distance = pass_.distance;
    uint32_t in_row = pass_.all;
    if (row < distance) in_row &= ~pass_.below;
    if (row + distance >= static_cast<int32_t>(shape_.rows)) in_row &= ~pass_.above;
    auto at = static_cast<uint32_t>(row) * shape_.pitch + static_cast<uint32_t>(column);
    for (; column < columns; column += step, at += static_cast<uint32_t>(step)) {
      uint32_t there = in_row;
      if (column < distance) there &= ~pass_.left;
      if (column + distance >= columns) there &= ~pass_.right;
      decode(at, there);
    }
  }

  void decode(uint32_t at, uint32_t there) {
    const uint8_t* const label = &drives_.labels[at];
    Gain* const own = &drives_.gains[at * shape_.actuators];
    std::array<const Gain*, 4> near;
    uint32_t count = 0;
    const auto carries_label = [&](uint32_t n) { return label[pass_.regions[n]] == *label; };
    if (there == 0b1111 && carries_label(0) && carries_label(1) && carries_label(2) &&
        carries_label(3)) {  // as nearly always
      near = {own + gains_to_[0], own + gains_to_[1], own + gains_to_[2], own + gains_to_[3]};
      count = 4;
    }
    for (uint32_t n = 0; count < 4 && there != 0; ++n, there >>= 1) {
      if ((there & 1U) != 0 && carries_label(n)) near[count++] = own + gains_to_[n];
    }
    if (count == 0 && drives_.latest[*label] != kNone) {
      near[count++] = &drives_.gains[drives_.latest[*label] * shape_.actuators];
    }
    drives_.latest[*label] = static_cast<uint16_t>(at);
    const Differences differences = read_differences();
    uint32_t beyond = 0;
    if (count == 4) {
      beyond = fill_as<true>(differences, own, near, 0);
    } else {
      // Fewer than four neighbours are filled up with silence: one loop, and no counting in it.
      for (uint32_t n = count; n < 4; ++n) near[n] = kSilence.data();
      beyond = fill_as<false>(differences, own, near, kShares[count]);
    }
    // No drive beyond full scale stays in memory, whatever the stream says.
    if (beyond != 0) {
      stream_.fail(Status::kDamaged);
      for (uint32_t channel = 0; channel < shape_.actuators; ++channel) own[channel] = {};
    }
  }

  template <bool kIsOfFour>
  uint32_t fill_as(Differences differences, Gain* own, const std::array<const Gain*, 4>& near,
                   int32_t share) const {
    switch (differences) {
      case Differences::kNone: return fill<kIsOfFour, Differences::kNone>(own, near, share);
      case Differences::kSmall: return fill<kIsOfFour, Differences::kSmall>(own, near, share);
      default: return fill<kIsOfFour, Differences::kAny>(own, near, share);
    }
  }

  // A region's drives: the mean of four, or `share` times a sum, and what it is off by.
  // Not 0 if one is beyond full scale.
  template <bool kIsOfFour, Differences kDifferences>
  uint32_t fill(Gain* own, const std::array<const Gain*, 4>& near, int32_t share) const {
    constexpr uint32_t kLargest = f::kFullScale * f::kFullScale;
    const auto mean = [share](int32_t sum) {
      // A sum of n values of 16 bits times 65536 / n: within 32 bits.
      return kIsOfFour ? (sum + 2) >> 2 : (sum * share + 32768) >> 16;
    };
    const Gain *a = near[0], *b = near[1], *c = near[2], *d = near[3];
    const int32_t* difference = differences_.data();
    uint32_t range = 0, excess = 0;
    for (Gain* const end = own + shape_.actuators; own != end; ++own, ++a, ++b, ++c, ++d) {
      int32_t in_phase =
          mean(a->in_phase_q15 + b->in_phase_q15 + c->in_phase_q15 + d->in_phase_q15);
      int32_t quadrature =
          mean(a->quadrature_q15 + b->quadrature_q15 + c->quadrature_q15 + d->quadrature_q15);
      if (kDifferences != Differences::kNone) {
        in_phase += difference[0];
        quadrature += difference[1];
        difference += 2;
      }
      if (kDifferences == Differences::kAny) {
        range |=
            static_cast<uint32_t>(in_phase + 32768) | static_cast<uint32_t>(quadrature + 32768);
      }
      // A sum of squares up to 2^31 + kLargest shows in the sign if it is too large.
      const auto i = static_cast<uint32_t>(in_phase), q = static_cast<uint32_t>(quadrature);
      excess |= kLargest - (i * i + q * q);
      *own = {static_cast<int16_t>(in_phase), static_cast<int16_t>(quadrature)};
    }
    return (range >> 16) | (excess >> 31);
  }

  // What the prediction is off by.
  Differences read_differences() {
    if (stream_.number(1) == 0) return Differences::kNone;
    // Three zeros in a row leave the parameters as they are.
    if (!stream_.skip_zeros(3)) {
      // The most frequent step is none, which is told apart without a call.
      if (!stream_.skip_zeros(1)) step(stream_, rates_.shift, f::kMaxShift);
      if (!stream_.skip_zeros(1)) step(stream_, rates_.rice[0], f::kMaxRice);
      if (!stream_.skip_zeros(1)) step(stream_, rates_.rice[1], f::kMaxRice);
    }
    const uint32_t codes =
        stream_.signed_rice(shape_.actuators, rates_.rice, rates_.shift, differences_.data());
    if ((codes >> (kSmallBits - rates_.shift)) == 0) return Differences::kSmall;
    if ((codes >> (kCodeBits - rates_.shift)) != 0) {
      stream_.fail(Status::kDamaged);
      differences_.fill(0);
    }
    return Differences::kAny;
  }

  static constexpr std::array<int32_t, 5> kShares = {0, 65536, 32768, 21845, 16384};

  StreamReader& stream_;
  const SectionShape& shape_;
  SectionDrives& drives_;
  Rates rates_;
  Pass pass_{};
  std::array<int32_t, 4> gains_to_{};  // the same as `pass_.regions`, in gains
  std::array<int32_t, 2 * f::kMaxActuators> differences_{};
};

}  // namespace

Status decode_section(StreamReader& stream, const SectionShape& shape, SectionDrives& drives) {
  for (uint32_t label = 0; label < shape.labels; ++label) {
    const uint32_t x = stream.number(f::kCrossingBits), y = stream.number(f::kCrossingBits);
    if (x > kNegated || y > kNegated) stream.fail(Status::kDamaged);
    const bool is_cut_x = x == kCut, is_cut_y = y == kCut;
    drives.cuts[label] = by_flips(is_cut_x, is_cut_y, is_cut_x || is_cut_y);
    const bool is_odd_x = x == kNegated, is_odd_y = y == kNegated;
    drives.negations[label] = by_flips(is_odd_x, is_odd_y, is_odd_x != is_odd_y);
  }
  read_labels(stream, shape, drives);
  if (stream.status() != Status::kOk) return stream.status();
  Decoder(stream, shape, drives).decode_all();
  if (stream.status() == Status::kOk && !stream.is_at_end()) stream.fail(Status::kDamaged);
  return stream.status();
}

}  // namespace chladni
