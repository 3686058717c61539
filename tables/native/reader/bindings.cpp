// The firmware's own reading and keeping of tables, on bytes in memory instead of flash.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/complex.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <complex>
#include <cstring>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/storage/files/slot_store.hpp"
#include "core/table/table.hpp"

namespace nb = nanobind;

namespace {

using chladni::kSectorBytes;
using Places = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// Flash in memory, and the order in which its sectors were last written.
class Flash {
 public:
  explicit Flash(nb::bytes data) : bytes_(data.c_str(), data.c_str() + data.size()) {}
  Flash(const Flash&) = delete;
  Flash& operator=(const Flash&) = delete;

  const std::vector<uint8_t>& bytes() const { return bytes_; }
  const std::vector<uint32_t>& written() const { return written_; }

  chladni::Hal hal() {
    chladni::Hal result{};
    result.context = this;
    result.map_flash = [](void* context, chladni::FlashArea, uint32_t offset,
                          uint32_t count) -> const uint8_t* {
      const auto& own = static_cast<Flash*>(context)->bytes_;
      return offset > own.size() || count > own.size() - offset ? nullptr : own.data() + offset;
    };
    result.erase_sector = [](void* context, chladni::FlashArea, uint32_t offset) {
      auto& own = *static_cast<Flash*>(context);
      std::memset(own.bytes_.data() + offset, 0xFF, kSectorBytes);
      own.touch(offset / kSectorBytes);
      return true;
    };
    result.program_flash = [](void* context, chladni::FlashArea, uint32_t offset,
                              const uint8_t* bytes, uint32_t count) {
      auto& own = *static_cast<Flash*>(context);
      for (uint32_t k = 0; k < count; ++k) own.bytes_[offset + k] &= bytes[k];
      const uint32_t last = (offset + count - 1U) / kSectorBytes;
      for (uint32_t k = offset / kSectorBytes; k <= last; ++k) own.touch(k);
      return true;
    };
    return result;
  }

 private:
  void touch(uint32_t sector) {
    written_.erase(std::remove(written_.begin(), written_.end(), sector), written_.end());
    written_.push_back(sector);
  }

  std::vector<uint8_t> bytes_;
  std::vector<uint32_t> written_;
};

class FirmwareTable {
 public:
  FirmwareTable(nb::bytes data, uint32_t channels) : flash_(data), channels_(channels) {
    status_ = table_.load(flash_.hal(), channels);
  }

  std::string status() const { return chladni::to_text(status_); }
  std::string select(uint32_t frequency_millihertz) {
    return chladni::to_text(table_.select(frequency_millihertz));
  }

  auto lookup(Places x_um, Places y_um) const {
    if (!table_.is_loaded()) throw nb::value_error("no table is loaded");
    if (x_um.shape(0) != y_um.shape(0)) throw nb::value_error("as many x as y");
    const size_t count = x_um.shape(0);
    auto values = std::make_unique<int16_t[]>(count * channels_ * 2);
    int16_t* next = values.get();
    chladni::Drive drive{};
    for (size_t place = 0; place < count; ++place) {
      table_.drive_at({x_um(place), y_um(place)}, drive);
      for (uint32_t k = 0; k < channels_; ++k) {
        *next++ = drive[k].in_phase_q15;
        *next++ = drive[k].quadrature_q15;
      }
    }
    int16_t* const data = values.release();
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<int16_t*>(p); });
    return nb::ndarray<nb::numpy, int16_t, nb::ndim<3>>(
        data, {count, static_cast<size_t>(channels_), 2}, owner);
  }

  bool has_drives() const { return table_.is_loaded() && table_.has_drives(); }
  bool has_responses() const { return table_.is_loaded() && table_.has_responses(); }

  // Each channel's response and the own compliance, m/N.
  auto responses(Places x_um, Places y_um) const {
    if (!has_responses()) throw nb::value_error("no responses are loaded");
    if (x_um.shape(0) != y_um.shape(0)) throw nb::value_error("as many x as y");
    const size_t count = x_um.shape(0);
    std::vector<std::complex<float>> values;
    values.reserve(count * (channels_ + 1U));
    chladni::PlaceResponses found{};
    for (size_t place = 0; place < count; ++place) {
      table_.responses_at({x_um(place), y_um(place)}, found);
      for (uint32_t k = 0; k < channels_; ++k) {
        values.emplace_back(found.coils[k].re, found.coils[k].im);
      }
      values.emplace_back(found.own.re, found.own.im);
    }
    return as_matrix(values, count, channels_ + 1U);
  }

  // Newtons, metres, N/m.
  std::tuple<float, float, std::complex<float>> finger() const {
    if (!has_responses()) throw nb::value_error("no responses are loaded");
    const chladni::ReckonedFinger own = table_.finger();
    return {own.full_force_n, own.threshold_m, {own.stiffness.re, own.stiffness.im}};
  }

  auto coupling() const {
    if (!has_responses()) throw nb::value_error("no responses are loaded");
    std::vector<std::complex<float>> values;
    for (uint32_t row = 0; row < channels_; ++row) {
      for (uint32_t column = 0; column < channels_; ++column) {
        const chladni::ComplexFloat one = table_.coupling(row, column);
        values.emplace_back(one.re, one.im);
      }
    }
    return as_matrix(values, channels_, channels_);
  }

 private:
  static nb::ndarray<nb::numpy, std::complex<float>, nb::ndim<2>> as_matrix(
      const std::vector<std::complex<float>>& values, size_t rows, size_t columns) {
    using Value = std::complex<float>;
    auto copy = std::make_unique<Value[]>(values.size());
    std::copy(values.begin(), values.end(), copy.get());
    Value* const data = copy.release();
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<Value*>(p); });
    return {data, {rows, columns}, owner};
  }

  Flash flash_;
  uint32_t channels_;
  chladni::Table table_;
  chladni::TableStatus status_;
};

class FirmwareStore {
 public:
  explicit FirmwareStore(nb::bytes image) : flash_(image) {
    if (image.size() != chladni::store_format::kTablePartitionBytes) {
      throw nb::value_error("an image of the whole tables partition");
    }
    load();
  }

  uint32_t slot() const { return store_.slot(); }
  nb::bytes image() const {
    return nb::bytes(reinterpret_cast<const char*>(flash_.bytes().data()), flash_.bytes().size());
  }

  // A table into the other slot; afterwards it is the one that counts, if "ok" comes back.
  std::string update(nb::bytes data) {
    using chladni::StoreStatus;
    if (data.size() < chladni::table_format::kSmallestFile) return "not a table";
    const auto* const bytes = reinterpret_cast<const uint8_t*>(data.c_str());
    const auto size = static_cast<uint32_t>(data.size());
    const chladni::Hal hal = flash_.hal();
    StoreStatus status = store_.begin(hal, size, chladni::read_u32(bytes + size - 4U));
    if (status == StoreStatus::kOk && store_.must_erase()) status = store_.erase_slot(hal);
    if (status == StoreStatus::kOk) status = store_.write(hal, 0, bytes, size);
    if (status == StoreStatus::kOk) {
      status = store_.commit(hal, [&](uint32_t offset) {
        return is_table(bytes[chladni::table_format::kAtActuators], offset);
      });
    }
    load();
    return chladni::to_text(status);
  }

  // Back to what the other slot holds.
  std::string restore_other(uint32_t channels) {
    const chladni::StoreStatus status = store_.restore_other(
        flash_.hal(), [&](uint32_t offset) { return is_table(channels, offset); });
    load();
    return chladni::to_text(status);
  }

  // Offsets and bytes of all that was written, whole sectors, in the order in which they must be.
  std::vector<std::pair<uint32_t, nb::bytes>> writes() const {
    const std::vector<uint32_t>& sectors = flash_.written();
    std::vector<std::pair<uint32_t, nb::bytes>> result;
    for (size_t k = 0; k < sectors.size();) {
      size_t end = k + 1;
      while (end < sectors.size() && sectors[end] == sectors[end - 1] + 1U &&
             !is_trailer(sectors[end])) {
        ++end;
      }
      const char* const from =
          reinterpret_cast<const char*>(flash_.bytes().data()) + sectors[k] * kSectorBytes;
      result.emplace_back(sectors[k] * kSectorBytes, nb::bytes(from, (end - k) * kSectorBytes));
      k = end;
    }
    return result;
  }

 private:
  static bool is_trailer(uint32_t sector) {
    const uint32_t in_slot = sector * kSectorBytes % chladni::kTableSlots.slot_bytes;
    return in_slot == chladni::kTableSlots.trailer_offset();
  }
  // Which slot counts does not depend on the channels of whoever asks.
  void load() { store_.find(flash_.hal()); }
  bool is_table(uint32_t channels, uint32_t offset) {
    chladni::Table table;
    return table.load(flash_.hal(), channels, offset) == chladni::TableStatus::kOk;
  }

  Flash flash_;
  chladni::SlotStore store_{chladni::kTableSlots};
};

}  // namespace

NB_MODULE(_firmware, m) {
  nb::class_<FirmwareTable>(m, "FirmwareTable")
      .def(nb::init<nb::bytes, uint32_t>(), nb::arg("data"), nb::arg("channels"))
      .def_prop_ro("status", &FirmwareTable::status)
      .def("select", &FirmwareTable::select, nb::arg("frequency_millihertz"))
      .def("lookup", &FirmwareTable::lookup, nb::arg("x_um"), nb::arg("y_um"))
      .def_prop_ro("has_drives", &FirmwareTable::has_drives)
      .def_prop_ro("has_responses", &FirmwareTable::has_responses)
      .def("responses", &FirmwareTable::responses, nb::arg("x_um"), nb::arg("y_um"))
      .def("coupling", &FirmwareTable::coupling)
      .def("finger", &FirmwareTable::finger);
  nb::class_<FirmwareStore>(m, "FirmwareStore")
      .def(nb::init<nb::bytes>(), nb::arg("image"))
      .def_prop_ro("slot", &FirmwareStore::slot)
      .def_prop_ro("image", &FirmwareStore::image)
      .def("update", &FirmwareStore::update, nb::arg("table"))
      .def("restore_other", &FirmwareStore::restore_other, nb::arg("channels"))
      .def("writes", &FirmwareStore::writes);
}
