#include "sensing/converter.hpp"

#include <array>
#include <atomic>

#include "core/hal.hpp"
#include "esp_adc/adc_continuous.h"
#include "esp_attr.h"
#include "target.hpp"

namespace chladni::chip {

namespace {

// 160 MHz by 2048 on an ESP32, 5 MHz by 64 on an ESP32-S3: both without a rest.
constexpr uint32_t kRateHz = 78125;
// Handed over by the DMA at once, 0.8 ms.
constexpr uint32_t kFrameValues = 64;
constexpr uint32_t kAtOnce = 128;
constexpr uint16_t kValueBits = 0xFFF;

adc_continuous_handle_t converter = nullptr;
std::atomic<bool> has_lost{false};

bool IRAM_ATTR on_overflow(adc_continuous_handle_t, const adc_continuous_evt_data_t*, void*) {
  has_lost.store(true, std::memory_order_relaxed);
  return false;
}

esp_err_t set_up(uint8_t pin) {
  adc_unit_t unit{};
  adc_channel_t channel{};
  esp_err_t status = adc_continuous_io_to_channel(pin, &unit, &channel);
  if (status != ESP_OK) return status;
  adc_digi_pattern_config_t pattern{};
  pattern.atten = ADC_ATTEN_DB_12;
  pattern.channel = static_cast<uint8_t>(channel);
  pattern.unit = static_cast<uint8_t>(unit);
  pattern.bit_width = SOC_ADC_DIGI_MAX_BITWIDTH;
  adc_continuous_config_t setting{};
  setting.pattern_num = 1;
  setting.adc_pattern = &pattern;
  setting.sample_freq_hz = kRateHz;
  setting.conv_mode = ADC_CONV_SINGLE_UNIT_1;
  setting.format = kConverterFormat;
  status = adc_continuous_config(converter, &setting);
  if (status != ESP_OK) return status;
  adc_continuous_evt_cbs_t events{};
  events.on_pool_ovf = on_overflow;
  status = adc_continuous_register_event_callbacks(converter, &events, nullptr);
  return status == ESP_OK ? adc_continuous_start(converter) : status;
}

}  // namespace

bool converter_start(uint8_t pin) {
  has_lost.store(false, std::memory_order_relaxed);
  adc_continuous_handle_cfg_t setting{};
  setting.max_store_buf_size = kKeptValues * SOC_ADC_DIGI_RESULT_BYTES;
  setting.conv_frame_size = kFrameValues * SOC_ADC_DIGI_RESULT_BYTES;
  if (adc_continuous_new_handle(&setting, &converter) != ESP_OK) return false;
  if (set_up(pin) == ESP_OK) return true;
  adc_continuous_deinit(converter);
  return false;
}

uint32_t converter_heard(uint16_t* values, uint32_t most) {
  if (has_lost.load(std::memory_order_relaxed)) return kValuesLost;
  std::array<uint8_t, kAtOnce * SOC_ADC_DIGI_RESULT_BYTES> bytes;
  const uint32_t asked = (most < kAtOnce ? most : kAtOnce) * SOC_ADC_DIGI_RESULT_BYTES;
  uint32_t taken = 0;
  const esp_err_t status = adc_continuous_read(converter, bytes.data(), asked, &taken, 0);
  if (status == ESP_ERR_TIMEOUT) return 0;
  if (status != ESP_OK) return kValuesLost;
  // The value lies in the lowest bits on both chips, its channel above.
  const uint32_t count = taken / SOC_ADC_DIGI_RESULT_BYTES;
  for (uint32_t k = 0; k < count; ++k) {
    const uint8_t* const at = &bytes[k * SOC_ADC_DIGI_RESULT_BYTES];
    values[k] = static_cast<uint16_t>((at[0] | at[1] << 8) & kValueBits);
  }
  return count;
}

void converter_stop() {
  adc_continuous_stop(converter);
  adc_continuous_deinit(converter);
}

}  // namespace chladni::chip
