// ESP-IDF's continuous driver of the analogue-to-digital converter.
#pragma once

#include "fake_chip.hpp"

enum adc_unit_t { ADC_UNIT_1, ADC_UNIT_2 };
enum adc_channel_t { ADC_CHANNEL_0 };
enum { ADC_ATTEN_DB_12 = 3 };
enum adc_digi_convert_mode_t { ADC_CONV_SINGLE_UNIT_1 = 1 };
enum adc_digi_output_format_t { ADC_DIGI_OUTPUT_FORMAT_TYPE1, ADC_DIGI_OUTPUT_FORMAT_TYPE2 };
constexpr uint32_t SOC_ADC_DIGI_MAX_BITWIDTH = 12;
#if FAKE_ESP32S3
constexpr uint32_t SOC_ADC_DIGI_RESULT_BYTES = 4;
#else
constexpr uint32_t SOC_ADC_DIGI_RESULT_BYTES = 2;
#endif

struct adc_continuous_ctx_t;
using adc_continuous_handle_t = adc_continuous_ctx_t*;
struct adc_continuous_handle_cfg_t {
  uint32_t max_store_buf_size, conv_frame_size;
};
struct adc_digi_pattern_config_t {
  uint8_t atten, channel, unit, bit_width;
};
struct adc_continuous_config_t {
  uint32_t pattern_num;
  adc_digi_pattern_config_t* adc_pattern;
  uint32_t sample_freq_hz;
  adc_digi_convert_mode_t conv_mode;
  adc_digi_output_format_t format;
};
struct adc_continuous_evt_data_t {
  uint8_t* conv_frame_buffer;
  uint32_t size;
};
using adc_continuous_callback_t = bool (*)(adc_continuous_handle_t,
                                           const adc_continuous_evt_data_t*, void*);
struct adc_continuous_evt_cbs_t {
  adc_continuous_callback_t on_conv_done, on_pool_ovf;
};
esp_err_t adc_continuous_new_handle(const adc_continuous_handle_cfg_t* setting,
                                    adc_continuous_handle_t* made);
esp_err_t adc_continuous_io_to_channel(int pin, adc_unit_t* unit, adc_channel_t* channel);
esp_err_t adc_continuous_config(adc_continuous_handle_t own,
                                const adc_continuous_config_t* setting);
esp_err_t adc_continuous_register_event_callbacks(adc_continuous_handle_t own,
                                                  const adc_continuous_evt_cbs_t* events,
                                                  void* argument);
esp_err_t adc_continuous_start(adc_continuous_handle_t own);
esp_err_t adc_continuous_read(adc_continuous_handle_t own, uint8_t* bytes, uint32_t most,
                              uint32_t* taken, uint32_t wait_ms);
esp_err_t adc_continuous_stop(adc_continuous_handle_t own);
esp_err_t adc_continuous_deinit(adc_continuous_handle_t own);
