// The synthesis by itself, without a device around it: for tests of voices.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

#include "core/synthesis/synthesis.hpp"
#include "emulator/bindings/bindings.hpp"

namespace nb = nanobind;

namespace chladni::emulator {

namespace {

using Gains = std::vector<std::pair<int, int>>;
// Gains, level, whether it starts, frequency in millihertz.
using VoiceRow = std::tuple<Gains, uint32_t, bool, uint32_t>;
using Duties = nb::ndarray<nb::numpy, int16_t, nb::ndim<2>>;

class SynthesisAlone {
 public:
  SynthesisAlone(const SynthesisSettings& settings, const std::vector<uint16_t>& full_current_ma)
      : channels_(settings.channels) {
    SynthesisSettings own = settings;
    for (size_t k = 0; k < full_current_ma.size() && k < kMaxChannels; ++k) {
      own.limits.full_current_ma[k] = full_current_ma[k];
    }
    hal_.context = this;
    hal_.set_duties = [](void* context, int32_t* duties, uint32_t signs) {
      auto& self = *static_cast<SynthesisAlone*>(context);
      for (uint32_t k = 0; k < self.channels_; ++k) {
        const int32_t duty = ((signs >> k) & 1U) != 0 ? -duties[k] : duties[k];
        self.record_.push_back(static_cast<int16_t>(duty));
      }
    };
    if (!synthesis_.start(hal_, own)) throw nb::value_error("a setting is out of range");
  }

  bool play(const Gains& gains, uint32_t level_q15, uint32_t ramp_us, bool starts_touch) {
    return synthesis_.play(drive_of(gains), {level_q15, ramp_us, starts_touch});
  }

  bool play_voices(const std::vector<VoiceRow>& rows, uint32_t ramp_us, bool starts_touch) {
    if (rows.size() > kMaxVoices) throw nb::value_error("voices: at most five");
    Voices voices{};
    for (size_t v = 0; v < rows.size(); ++v) {
      const auto& [gains, level_q15, starts, frequency_millihertz] = rows[v];
      voices[v] = {drive_of(gains), level_q15, starts, frequency_millihertz};
    }
    return synthesis_.play_voices(voices, {0, ramp_us, starts_touch});
  }

  // Samples after so many that were missed; a sign of the finger comes with each millisecond's.
  Duties run(uint32_t samples, uint32_t missed) {
    record_.clear();
    for (uint32_t k = 0; k < samples; ++k) {
      if (k % 20U == 0) synthesis_.keep_alive();
      synthesis_.player().sample(k == 0 ? missed : 0U);
    }
    auto* record = new std::vector<int16_t>(std::move(record_));
    nb::capsule owner(record,
                      [](void* p) noexcept { delete static_cast<std::vector<int16_t>*>(p); });
    return Duties(record->data(), {record->size() / channels_, channels_}, owner);
  }

  Synthesis& synthesis() { return synthesis_; }

 private:
  Drive drive_of(const Gains& gains) const {
    if (gains.size() != channels_) throw nb::value_error("gains: one pair per channel");
    Drive drive{};
    for (size_t k = 0; k < gains.size(); ++k) {
      drive[k] = {static_cast<int16_t>(gains[k].first), static_cast<int16_t>(gains[k].second)};
    }
    return drive;
  }

  uint32_t channels_;
  Hal hal_{};
  Synthesis synthesis_{};
  std::vector<int16_t> record_;
};

}  // namespace

void bind_synthesis(nb::module_& m) {
  nb::class_<SynthesisAlone>(m, "Synthesis")
      .def(
          "__init__",
          [](SynthesisAlone* self, const std::vector<uint16_t>& full_current_ma, uint32_t pwm_bits,
             uint32_t supply_ma, uint32_t max_duty_q15, uint32_t min_on_steps, bool has_bridges,
             uint32_t lost_steps) {
            SynthesisSettings settings{};
            settings.channels = static_cast<uint32_t>(full_current_ma.size());
            settings.pwm_bits = pwm_bits;
            settings.frequency_millihertz = 160000;
            settings.ramp_us = 4000;
            settings.touch_timeout_us = 100000;
            settings.max_on_us = 60000000;
            settings.has_bridges = has_bridges;
            settings.lost_steps = lost_steps;
            for (uint32_t k = 0; k < kMaxChannels; ++k) {
              settings.sign_pins[k] = static_cast<uint8_t>(k);
            }
            settings.limits.supply_ma = supply_ma;
            settings.limits.max_duty_q15 = max_duty_q15;
            settings.limits.min_on_steps = min_on_steps;
            new (self) SynthesisAlone(settings, full_current_ma);
          },
          nb::kw_only(), nb::arg("full_current_ma"), nb::arg("pwm_bits") = 10,
          nb::arg("supply_ma") = 0, nb::arg("max_duty_q15") = 32768, nb::arg("min_on_steps") = 0,
          nb::arg("has_bridges") = false, nb::arg("lost_steps") = 0)
      .def("play", &SynthesisAlone::play, nb::arg("gains"), nb::arg("level_q15"),
           nb::arg("ramp_us"), nb::arg("starts_touch"))
      .def("play_voices", &SynthesisAlone::play_voices, nb::arg("voices"), nb::arg("ramp_us"),
           nb::arg("starts_touch"), "Voices: (gains, level, whether it starts, millihertz).")
      .def("run", &SynthesisAlone::run, nb::arg("samples"), nb::arg("missed") = 0,
           "Duties of so many samples, (samples, channels).")
      .def("release",
           [](SynthesisAlone& self, uint32_t ramp_us) { return self.synthesis().release(ramp_us); })
      .def("set_waveform",
           [](SynthesisAlone& self, uint32_t waveform) {
             return self.synthesis().set_waveform(static_cast<Waveform>(waveform));
           })
      .def("stop", [](SynthesisAlone& self) { self.synthesis().stop(Stop::kAtOnce); })
      .def_prop_ro("limited", [](SynthesisAlone& self) { return self.synthesis().limited(); })
      .def_prop_ro("is_quiet", [](SynthesisAlone& self) { return self.synthesis().is_quiet(); });
}

}  // namespace chladni::emulator
