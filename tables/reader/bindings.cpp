// The firmware's table, read from bytes in memory instead of flash.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/table.hpp"

namespace nb = nanobind;

namespace {

using Places = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

class FirmwareTable {
 public:
  FirmwareTable(nb::bytes data, uint32_t channels)
      : bytes_(data.c_str(), data.c_str() + data.size()), channels_(channels) {
    status_ = table_.load(hal(), channels);
  }

  std::string status() const { return chladni::to_text(status_); }

  std::string select(uint32_t frequency_mhz) {
    return chladni::to_text(table_.select(hal(), frequency_mhz));
  }

  uint32_t frequency_mhz() const { return table_.frequency_mhz(); }

  uint32_t region_at(int32_t x_um, int32_t y_um) const {
    check_loaded();
    return table_.region_at({x_um, y_um});
  }

  auto lookup(Places x_um, Places y_um) const {
    check_loaded();
    if (x_um.shape(0) != y_um.shape(0)) throw nb::value_error("as many x as y");
    const size_t count = x_um.shape(0);
    std::vector<chladni::Drive> drives(count);
    for (size_t k = 0; k < count; ++k) table_.drive_at({x_um(k), y_um(k)}, drives[k]);
    return as_array(drives);
  }

  auto regions() const {
    check_loaded();
    std::vector<chladni::Drive> drives(table_.regions());
    for (uint32_t k = 0; k < table_.regions(); ++k) table_.drive(k, drives[k]);
    return as_array(drives);
  }

 private:
  void check_loaded() const {
    if (!table_.is_loaded()) throw nb::value_error("no table is loaded");
  }

  nb::ndarray<nb::numpy, int16_t, nb::ndim<3>> as_array(
      const std::vector<chladni::Drive>& drives) const {
    auto values = std::make_unique<int16_t[]>(drives.size() * channels_ * 2);
    int16_t* next = values.get();
    for (const chladni::Drive& drive : drives) {
      for (uint32_t k = 0; k < channels_; ++k) {
        *next++ = drive[k].in_phase_q15;
        *next++ = drive[k].quadrature_q15;
      }
    }
    int16_t* const data = values.release();
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<int16_t*>(p); });
    return nb::ndarray<nb::numpy, int16_t, nb::ndim<3>>(
        data, {drives.size(), static_cast<size_t>(channels_), 2}, owner);
  }

  chladni::Hal hal() {
    chladni::Hal result{};
    result.context = this;
    result.read_flash = [](void* context, chladni::FlashArea, uint32_t offset, uint8_t* bytes,
                           uint32_t count) {
      const auto& own = static_cast<FirmwareTable*>(context)->bytes_;
      if (offset > own.size() || count > own.size() - offset) return false;
      std::memcpy(bytes, own.data() + offset, count);
      return true;
    };
    return result;
  }

  std::vector<uint8_t> bytes_;
  uint32_t channels_;
  chladni::Table table_;
  chladni::TableStatus status_;
};

}  // namespace

NB_MODULE(_firmware, m) {
  nb::class_<FirmwareTable>(m, "FirmwareTable")
      .def(nb::init<nb::bytes, uint32_t>(), nb::arg("data"), nb::arg("channels"))
      .def_prop_ro("status", &FirmwareTable::status)
      .def_prop_ro("frequency_mhz", &FirmwareTable::frequency_mhz)
      .def("select", &FirmwareTable::select, nb::arg("frequency_mhz"))
      .def("region_at", &FirmwareTable::region_at, nb::arg("x_um"), nb::arg("y_um"))
      .def("lookup", &FirmwareTable::lookup, nb::arg("x_um"), nb::arg("y_um"))
      .def("regions", &FirmwareTable::regions);
}
