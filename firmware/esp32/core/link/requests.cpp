#include "core/link/requests.hpp"

#include "core/base/bytes.hpp"
#include "core/storage/network_record.hpp"

namespace chladni {

namespace {

namespace f = link_format;
using Status = f::Status;

int32_t signed_word(const uint8_t* bytes) { return static_cast<int32_t>(word(bytes, 4)); }

}  // namespace

bool Requests::take(Conversation& with, const uint8_t* bytes, uint32_t size) {
  if (size < f::kHeadBytes) return false;
  const uint32_t kind = bytes[0], sequence = bytes[1];
  if ((kind & f::kResponse) != 0) return false;  // somebody else's answer
  const bool is_repeated =
      kind == with.last_kind && sequence == with.last_sequence && with.answer_size > 0;
  // What is being repeated was answered; data carries its place, and is looked at again.
  if (is_repeated && kind != f::table_data::kCode) return true;
  with_ = &with;
  with.answer[0] = static_cast<uint8_t>(kind | f::kResponse);
  with.answer[1] = static_cast<uint8_t>(sequence);
  with.answer_size = kAnswerHead;
  const Status status = handle(kind, {bytes + f::kHeadBytes, size - f::kHeadBytes});
  with.answer[2] = static_cast<uint8_t>(status);
  // What has to be asked again must be done then.
  with.last_kind = status == Status::kBusy ? 0U : kind;
  with.last_sequence = sequence;
  return true;
}

// Appends a field to the answer; answers are all shorter than their buffer.
void Requests::put(uint32_t value, uint32_t bytes) {
  for (uint32_t k = 0; k < bytes && with_->answer_size < with_->answer.size(); ++k) {
    with_->answer[with_->answer_size++] = static_cast<uint8_t>((value >> (8U * k)) & 0xFFU);
  }
}

Status Requests::handle(uint32_t kind, const Request& request) {
  switch (kind) {
    case f::hello::kCode:
      if (request.size < f::hello::kRequestBytes) return Status::kMalformed;
      put(f::kVersionMajor, 1);
      put(f::kVersionMinor, 1);
      put(f::kWindow, 2);
      put(f::kMaxPayload, 2);
      return request.fields[f::hello::kRequestMajor] == f::kVersionMajor ? Status::kOk
                                                                         : Status::kIncompatible;
    case f::info::kCode: return put_info();
    case f::faults::kCode: return put_faults();
    case f::config_get::kCode: return put_config();
    case f::network_get::kCode: return put_network();
    case f::network_set::kCode: return set_network(request);
    case f::table_begin::kCode:
    case f::table_data::kCode:
    case f::table_commit::kCode:
    case f::table_previous::kCode: return handle_table(kind, request);
    default: return handle_host(kind, request);
  }
}

Status Requests::handle_table(uint32_t kind, const Request& request) {
  const uint8_t* const at = request.fields;
  if (kind == f::table_begin::kCode) {
    constexpr uint32_t kFixed = f::table_begin::kRequestBytes;
    if (request.size != kFixed + table_format::kHeaderBytes) return Status::kMalformed;
    TableStatus refused = TableStatus::kOk;
    const uint32_t crc = word(at + f::table_begin::kRequestCrc, 4);
    const Status status = device_.table_begin(word(at, 4), crc, at + kFixed, refused);
    put(static_cast<uint32_t>(refused), 1);
    return status;
  }
  if (kind == f::table_data::kCode) {
    if (request.size <= f::table_data::kRequestBytes) return Status::kMalformed;
    const uint32_t fixed = f::table_data::kRequestBytes;
    const Status status = device_.table_data(word(at, 4), at + fixed, request.size - fixed);
    put(device_.table_next(), 4);
    return status;
  }
  if (request.size != 0) return Status::kMalformed;
  const Status status =
      kind == f::table_commit::kCode ? device_.table_commit() : device_.table_previous();
  put(device_.slot(), 1);
  put(static_cast<uint32_t>(device_.table_status()), 1);
  return status;
}

Status Requests::handle_host(uint32_t kind, const Request& request) {
  const uint8_t* const at = request.fields;
  switch (kind) {
    case f::touch::kCode: {
      if (request.size != f::touch::kRequestBytes) return Status::kMalformed;
      if (!device_.table().is_loaded()) return Status::kNotNow;
      const Place place = device_.touch({signed_word(at), signed_word(at + 4)});
      put(static_cast<uint32_t>(place.x_um), 4);
      put(static_cast<uint32_t>(place.y_um), 4);
      return Status::kOk;
    }
    case f::lift::kCode:
      device_.lift();
      put(device_.played_ms(), 4);
      return Status::kOk;
    case f::frequency::kCode: {
      if (request.size != f::frequency::kRequestBytes) return Status::kMalformed;
      if (device_.state() != DeviceState::kIdle) return Status::kNotNow;
      const TableStatus status = device_.select_frequency(word(at, 4));
      put(static_cast<uint32_t>(status), 1);
      return status == TableStatus::kOk ? Status::kOk : Status::kRefused;
    }
    case f::waveform::kCode:
      if (request.size != f::waveform::kRequestBytes || at[0] >= kWaveforms) {
        return Status::kMalformed;
      }
      return device_.set_waveform(static_cast<Waveform>(at[0])) ? Status::kOk : Status::kRefused;
    case f::config_set::kCode: {
      if (!device_.is_quiet()) return Status::kNotNow;
      if (!device_.may_write()) return Status::kTooOften;
      const ConfigStatus status = device_.set_config(at, request.size, via_ == Via::kWire);
      put(static_cast<uint32_t>(status), 1);
      return status == ConfigStatus::kOk ? Status::kOk : Status::kRefused;
    }
    case f::restart::kCode: device_.restart_soon(); return Status::kOk;
    case f::stream_begin::kCode: {
      if (request.size != f::stream_begin::kRequestBytes) return Status::kMalformed;
      const uint32_t target = word(at, 2);
      if (target < f::kLeastTarget || target > f::kMostTarget) return Status::kMalformed;
      return device_.stream_begin(target) ? Status::kOk : Status::kNotNow;
    }
    case f::stream_data::kCode: return take_stream(request);
    case f::stream_end::kCode: device_.stream_end(); return Status::kOk;
    case f::live::kCode: return take_live(request);
    default: return Status::kUnknown;
  }
}

Status Requests::put_info() {
  const Table& table = device_.table();
  put(static_cast<uint32_t>(device_.state()), 1);
  put(static_cast<uint32_t>(device_.table_status()), 1);
  put(static_cast<uint32_t>(device_.config_status()), 1);
  put(static_cast<uint32_t>(device_.input().health()), 1);
  put(device_.slot(), 1);
  put(device_.config().channels, 1);
  put(device_.synthesis().missed(), 2);
  put(device_.now_ms(), 4);
  put(device_.faults().count(), 4);
  put(device_.heat().supply_ma(), 4);
  const bool has_table = table.is_loaded();
  put(has_table ? table.frequency_millihertz() : 0U, 4);
  put(has_table ? table.total_bytes() : 0U, 4);
  put(has_table ? table.crc() : 0U, 4);
  for (uint32_t k = 0; k < 8; ++k) put(has_table ? table.identity()[k] : 0U, 1);
  for (uint32_t k = 8; k < Table::kIdentityBytes; ++k) put(has_table ? table.identity()[k] : 0U, 1);
  for (uint32_t k = 0; k < kMaxChannels; ++k) put(device_.heat().rise_dk(k), 2);
  put(device_.stack_free(), 4);
  put(device_.faults().standing(), 4);
  put(device_.erases(), 4);
  return Status::kOk;
}

Status Requests::put_faults() {
  const FaultLog& log = device_.faults();
  put(log.kept(), 1);
  for (uint32_t k = 0; k < log.kept(); ++k) {
    const Fault& fault = log.at(k);
    put(static_cast<uint32_t>(fault.cause), 4);
    put(fault.detail, 4);
    put(fault.at_ms, 4);
  }
  return Status::kOk;
}

Status Requests::put_config() {
  std::array<uint8_t, config_format::kRecordBytes> record{};
  write_record(device_.config(), 0, record.data());
  for (const uint8_t byte : record) put(byte, 1);
  return Status::kOk;
}

Status Requests::put_network() {
  const bool has_address = network_.is_on && network_.address != 0;
  put(network_.is_on ? (has_address ? 2U : 1U) : 0U, 1);
  put(network_.port, 2);
  put(network_.address, 4);
  put(network_.accepted, 4);
  put(network_.rejected, 4);
  for (uint32_t k = 0; k < network_format::kSsidBytes; ++k) {
    put(static_cast<uint8_t>(network_.ssid[k]), 1);
  }
  return Status::kOk;
}

// Who is on the network must not be able to let others in, or to lock the owner out.
Status Requests::set_network(const Request& request) {
  if (via_ != Via::kWire) return Status::kRefused;
  if (!device_.is_quiet()) return Status::kNotNow;
  if (!device_.may_write()) return Status::kTooOften;
  Network parsed;
  if (request.size > 0 && !parse_network(request.fields, request.size, parsed)) {
    return Status::kMalformed;
  }
  return device_.set_network(request.fields, request.size) ? Status::kOk : Status::kFlashFailed;
}

Status Requests::take_stream(const Request& request) {
  const uint32_t channels = device_.config().channels;
  const uint32_t frames = request.size * 8U / (10U * channels);
  uint32_t taken = 0, bit = 0;
  bool has_room = device_.state() == DeviceState::kStreaming;
  while (taken < frames && has_room) {
    std::array<uint16_t, kMaxChannels> duties{};
    for (uint32_t k = 0; k < channels; ++k, bit += 10U) {
      const uint32_t two = word(request.fields + bit / 8U, 2);
      duties[k] = static_cast<uint16_t>(((two >> (bit % 8U)) & 0x3FFU) << 6);
    }
    has_room = device_.stream_push(duties.data());
    if (has_room) ++taken;
  }
  put(taken, 2);
  put(device_.stream().filled(), 2);
  return device_.state() == DeviceState::kStreaming ? Status::kOk : Status::kNotNow;
}

Status Requests::take_live(const Request& request) {
  const uint32_t channels = device_.config().channels;
  const uint8_t* const at = request.fields;
  if (request.size != f::live::kRequestBytes + 4U * channels) return Status::kMalformed;
  const uint32_t waveform = at[f::live::kRequestWaveform];
  if (waveform >= kWaveforms) return Status::kMalformed;
  Drive drive{};
  for (uint32_t k = 0; k < channels; ++k) {
    const uint8_t* const gain = at + f::live::kRequestBytes + 4U * k;
    drive[k] = {static_cast<int16_t>(word(gain, 2)), static_cast<int16_t>(word(gain + 2, 2))};
  }
  const uint32_t millihertz = word(at + f::live::kRequestMillihertz, 4);
  if (millihertz < table_format::kMinFrequencyMillihertz ||
      millihertz > table_format::kMaxFrequencyMillihertz) {
    return Status::kMalformed;
  }
  if (device_.play_live(drive, millihertz, static_cast<Waveform>(waveform))) return Status::kOk;
  return device_.state() == DeviceState::kStreaming ? Status::kBusy : Status::kNotNow;
}

}  // namespace chladni
