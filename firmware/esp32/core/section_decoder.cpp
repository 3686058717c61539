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

// 0, 1, 2, 3 … as 0, -1, 1, -2 …: half the code, all its bits turned over if it is odd.
int32_t from_zigzag(uint32_t code) {
  return static_cast<int32_t>(code >> 1) ^ -static_cast<int32_t>(code & 1U);
}

// Bit f: what holds for the flips f.
uint8_t by_flips(bool in_x, bool in_y, bool in_both) {
  return static_cast<uint8_t>((in_x ? 2U : 0U) + (in_y ? 4U : 0U) + (in_both ? 8U : 0U));
}

uint32_t bits_below(uint32_t count) {
  uint32_t width = 0;
  while (((count - 1U) >> width) != 0) ++width;
  return width;
}

// The label above, unless the one to the left differs from its own upper neighbour.
uint8_t expected_label(const uint8_t* own, uint32_t column, uint32_t row, uint32_t pitch) {
  if (row == 0) return column == 0 ? uint8_t{0} : own[-1];
  const uint8_t* const above = own - pitch;
  if (column == 0) return *above;
  return above[-1] == *above ? own[-1] : *above;
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
    uint8_t* own = drives.labels.data() + row * shape.pitch;
    for (uint32_t column = 0; column < shape.columns; ++column, ++own) {
      if (run == 0) {
        const uint32_t label = stream.number(width);
        if (label >= shape.labels) stream.fail(Status::kDamaged);
        *own = static_cast<uint8_t>(label);
        run = read_run(stream);
      } else {
        *own = expected_label(own, column, row, shape.pitch);
        --run;
      }
      if (stream.status() != Status::kOk) return;
    }
  }
  if (run != 0) stream.fail(Status::kDamaged);
}

// Parameters of the Rice codes.
struct Rates {
  uint32_t shift;
  std::array<uint32_t, 2> rice;
};

void step(StreamReader& stream, uint32_t& value, uint32_t largest) {
  const int32_t moved = static_cast<int32_t>(value) + from_zigzag(stream.unary());
  if (moved < 0 || moved > static_cast<int32_t>(largest)) {
    stream.fail(Status::kDamaged);
    return;
  }
  value = static_cast<uint32_t>(moved);
}

// Gains of the regions that tell what to expect of the one being decoded.
struct Neighbours {
  std::array<const Gain*, 4> gains;
  uint32_t count;
};

constexpr std::array<Gain, f::kMaxActuators> kSilence{};

class Decoder {
 public:
  Decoder(StreamReader& stream, const SectionShape& shape, SectionDrives& drives)
      : stream_(stream), shape_(shape), drives_(drives), rates_{shape.start_shift, {}} {
    rates_.rice.fill(f::kStartRice);
    for (uint32_t label = 0; label < shape.labels; ++label) drives_.latest[label] = kNone;
  }

  void decode_all() {
    const uint32_t larger = shape_.columns > shape_.rows ? shape_.columns : shape_.rows;
    int32_t span = 1;
    while (span < static_cast<int32_t>(f::kCoarsest) && span < static_cast<int32_t>(larger)) {
      span *= 2;
    }
    const auto columns = static_cast<int32_t>(shape_.columns);
    const auto rows = static_cast<int32_t>(shape_.rows);
    for (int32_t j = 0; j < rows; j += span) {
      for (int32_t i = 0; i < columns; i += span) {
        start(i, j);
        const auto s = static_cast<uint32_t>(span);
        if (i > 0) consider(at_ - s);
        if (j > 0) consider(at_ - s * shape_.pitch);
        decode();
      }
    }
    for (; span > 1; span /= 2) {
      const int32_t half = span / 2;
      reach_ = static_cast<uint32_t>(half) * shape_.pitch;
      for (int32_t j = half; j < rows; j += span) {
        for (int32_t i = half; i < columns; i += span) {
          start(i, j);
          const bool has_right = i + half < columns, has_above = j + half < rows;
          const auto h = static_cast<uint32_t>(half);
          consider(at_ - reach_ - h);
          if (has_right) consider(at_ - reach_ + h);
          if (has_above) consider(at_ + reach_ - h);
          if (has_right && has_above) consider(at_ + reach_ + h);
          decode();
        }
      }
      bool is_on_row = true;  // of the coarser level: only every second is missing
      for (int32_t j = 0; j < rows; j += half) {
        for (int32_t i = is_on_row ? half : 0; i < columns; i += span) {
          start(i, j);
          const auto h = static_cast<uint32_t>(half);
          if (j > 0) consider(at_ - reach_);
          if (i > 0) consider(at_ - h);
          if (i + half < columns) consider(at_ + h);
          if (j + half < rows) consider(at_ + reach_);
          decode();
        }
        is_on_row = !is_on_row;
      }
    }
  }

 private:
  void start(int32_t column, int32_t row) {
    at_ = static_cast<uint32_t>(row) * shape_.pitch + static_cast<uint32_t>(column);
    label_ = drives_.labels[at_];
    near_.count = 0;
  }

  void consider(uint32_t at) {
    if (drives_.labels[at] == label_) near_.gains[near_.count++] = gains_of(at);
  }

  void decode() {
    if (near_.count == 0 && drives_.latest[label_] != kNone) {
      near_.gains[0] = gains_of(drives_.latest[label_]);
      near_.count = 1;
    }
    const bool is_as_expected = stream_.number(1) == 0;
    if (!is_as_expected) {
      step(stream_, rates_.shift, f::kMaxShift);
      for (uint32_t& rice : rates_.rice) step(stream_, rice, f::kMaxRice);
      read_differences();
    }
    // Fewer than four neighbours are filled up with silence: one loop, and no counting in it.
    for (uint32_t n = near_.count; n < 4; ++n) near_.gains[n] = kSilence.data();
    const Gain *a = near_.gains[0], *b = near_.gains[1], *c = near_.gains[2], *d = near_.gains[3];
    const int32_t share = kShares[near_.count];
    const int32_t scale = is_as_expected ? 0 : static_cast<int32_t>(1U << rates_.shift);
    const int32_t* difference = differences_.data();
    Gain* own = &drives_.gains[at_ * shape_.actuators];
    for (Gain* const end = own + shape_.actuators; own != end; ++own, ++a, ++b, ++c, ++d) {
      // Sums of n values of 16 bits times 65536 / n: all within 32 bits.
      const int32_t in_phase =
          a->in_phase_q15 + b->in_phase_q15 + c->in_phase_q15 + d->in_phase_q15;
      const int32_t quadrature =
          a->quadrature_q15 + b->quadrature_q15 + c->quadrature_q15 + d->quadrature_q15;
      put(*own, ((in_phase * share + 32768) >> 16) + difference[0] * scale,
          ((quadrature * share + 32768) >> 16) + difference[1] * scale);
      difference += 2;
    }
    drives_.latest[label_] = static_cast<uint16_t>(at_);
  }

  // What the prediction is off by, in steps of 2^shift.
  void read_differences() {
    std::array<uint32_t, 2 * f::kMaxActuators> codes;
    const uint32_t count = 2 * shape_.actuators, too_large = kCodeBits - rates_.shift;
    stream_.rice(shape_.actuators, rates_.rice[0], rates_.rice[1], codes.data());
    uint32_t all = 0;
    for (uint32_t k = 0; k < count; ++k) {
      all |= codes[k];
      differences_[k] = from_zigzag(codes[k]);
    }
    if ((all >> too_large) != 0) {
      stream_.fail(Status::kDamaged);
      differences_.fill(0);
    }
  }

  const Gain* gains_of(uint32_t at) const { return &drives_.gains[at * shape_.actuators]; }

  // No drive beyond full scale gets into memory, whatever the stream says.
  void put(Gain& gain, int32_t in_phase, int32_t quadrature) {
    constexpr auto kFull = static_cast<int32_t>(f::kFullScale);
    // One comparison for both signs: below the lower end an unsigned number is beyond the upper.
    constexpr uint32_t kBoth = 2 * f::kFullScale;
    const bool fits = static_cast<uint32_t>(in_phase + kFull) <= kBoth &&
                      static_cast<uint32_t>(quadrature + kFull) <= kBoth &&
                      static_cast<uint32_t>(in_phase * in_phase) +
                              static_cast<uint32_t>(quadrature * quadrature) <=
                          f::kFullScale * f::kFullScale;
    if (!fits) {
      stream_.fail(Status::kDamaged);
      in_phase = 0;
      quadrature = 0;
    }
    gain = {static_cast<int16_t>(in_phase), static_cast<int16_t>(quadrature)};
  }

  static constexpr std::array<int32_t, 5> kShares = {0, 65536, 32768, 21845, 16384};

  StreamReader& stream_;
  const SectionShape& shape_;
  SectionDrives& drives_;
  Rates rates_;
  uint32_t reach_ = 0;  // from a row to the one half a level's step above
  uint32_t at_ = 0;
  uint8_t label_ = 0;
  Neighbours near_{};
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
