// The converter: 78,125 values a second of a sine of 300 steps about the middle of its range, four
// times 80 MHz / 1024 / 1952. Its driver hands whole frames over and keeps as many as it was told.
#include <cmath>

#include "idf.hpp"

namespace {

using fake::call;
using fake::chip;

constexpr uint64_t kCyclesPerValue = 3072;
constexpr double kTurn = 6.283185307179586;

struct Converter {
  bool is_made = false, is_started = false;
  adc_continuous_handle_cfg_t setting{};
  adc_continuous_evt_cbs_t events{};
  uint64_t begun = 0, read = 0;  // cycles, and values
} converter;

adc_continuous_handle_t handle() { return reinterpret_cast<adc_continuous_handle_t>(&converter); }

void check(adc_continuous_handle_t own, bool is_started) {
  if (own != handle() || !converter.is_made) throw fake::Misuse("no such converter");
  if (converter.is_started != is_started) throw fake::Misuse("the converter's state");
}

}  // namespace

esp_err_t adc_continuous_new_handle(const adc_continuous_handle_cfg_t* setting,
                                    adc_continuous_handle_t* made) {
  if (converter.is_made) throw fake::Misuse("a second converter");
  if (setting->conv_frame_size % 4U != 0) throw fake::Misuse("half a word");
  const esp_err_t status = call("adc_continuous_new_handle");
  if (status != ESP_OK) return status;
  converter = Converter{};
  converter.is_made = true;
  converter.setting = *setting;
  *made = handle();
  return ESP_OK;
}

// Converter 1's pins (data sheets of both chips).
esp_err_t adc_continuous_io_to_channel(int pin, adc_unit_t* unit, adc_channel_t* channel) {
  *unit = ADC_UNIT_1;
#if FAKE_ESP32S3
  if (pin < 1 || pin > 10) return ESP_ERR_NOT_FOUND;
  *channel = static_cast<adc_channel_t>(pin - 1);
#else
  constexpr int kPins[8] = {36, 37, 38, 39, 32, 33, 34, 35};
  int k = 0;
  while (k < 8 && kPins[k] != pin) ++k;
  if (k == 8) return ESP_ERR_NOT_FOUND;
  *channel = static_cast<adc_channel_t>(k);
#endif
  return call("adc_continuous_io_to_channel");
}

esp_err_t adc_continuous_config(adc_continuous_handle_t own,
                                const adc_continuous_config_t* setting) {
  check(own, false);
#if FAKE_ESP32S3
  const bool is_own = setting->format == ADC_DIGI_OUTPUT_FORMAT_TYPE2;
#else
  const bool is_own = setting->format == ADC_DIGI_OUTPUT_FORMAT_TYPE1;
#endif
  if (!is_own) throw fake::Misuse("another chip's format");
  // Of an ESP32-S3 83,333 Hz is the most, of an ESP32 20 kHz the least (soc_caps.h).
  if (setting->sample_freq_hz < 20000 || setting->sample_freq_hz > 83333)
    return ESP_ERR_INVALID_ARG;
  return call("adc_continuous_config");
}

esp_err_t adc_continuous_register_event_callbacks(adc_continuous_handle_t own,
                                                  const adc_continuous_evt_cbs_t* events, void*) {
  check(own, false);
  converter.events = *events;
  return call("adc_continuous_register_event_callbacks");
}

esp_err_t adc_continuous_start(adc_continuous_handle_t own) {
  check(own, false);
  const esp_err_t status = call("adc_continuous_start");
  if (status != ESP_OK) return status;
  converter.is_started = true;
  converter.begun = chip.cycles;
  converter.read = 0;
  return ESP_OK;
}

esp_err_t adc_continuous_read(adc_continuous_handle_t own, uint8_t* bytes, uint32_t most,
                              uint32_t* taken, uint32_t wait_ms) {
  check(own, true);
  if (wait_ms != 0) throw fake::Misuse("the main loop waits for the converter");
  const uint64_t frame = converter.setting.conv_frame_size / SOC_ADC_DIGI_RESULT_BYTES;
  const uint64_t kept = converter.setting.max_store_buf_size / SOC_ADC_DIGI_RESULT_BYTES;
  const uint64_t all = (chip.cycles - converter.begun) / kCyclesPerValue / frame * frame;
  if (all - converter.read > kept) {
    const adc_continuous_evt_data_t event{};
    converter.events.on_pool_ovf(own, &event, nullptr);
    converter.read = all - kept;
  }
  uint32_t count = 0;
  while ((count + 1U) * SOC_ADC_DIGI_RESULT_BYTES <= most && converter.read < all) {
    const double turns = 4.0 * static_cast<double>(converter.read) / 1952.0;
    const auto value = static_cast<uint32_t>(std::lround(2048.0 + 300.0 * std::cos(kTurn * turns)));
    // What lies above the value is the channel's number.
    const uint32_t word = value | 5U << 12;
    for (uint32_t k = 0; k < SOC_ADC_DIGI_RESULT_BYTES; ++k) {
      bytes[count * SOC_ADC_DIGI_RESULT_BYTES + k] = static_cast<uint8_t>(word >> (8U * k));
    }
    ++count;
    ++converter.read;
  }
  *taken = count * SOC_ADC_DIGI_RESULT_BYTES;
  const esp_err_t status = call("adc_continuous_read");
  if (status != ESP_OK) return status;
  return count == 0 ? ESP_ERR_TIMEOUT : ESP_OK;
}

esp_err_t adc_continuous_stop(adc_continuous_handle_t own) {
  check(own, true);
  converter.is_started = false;
  return call("adc_continuous_stop");
}

esp_err_t adc_continuous_deinit(adc_continuous_handle_t own) {
  check(own, false);
  converter.is_made = false;
  return call("adc_continuous_deinit");
}
