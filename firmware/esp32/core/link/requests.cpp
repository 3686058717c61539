#include "core/link/requests.hpp"

#include "core/base/bytes.hpp"
#include "core/base/crc32.hpp"
#include "core/generated/link_messages.hpp"
#include "core/storage/network_record.hpp"

namespace chladni {

namespace {

namespace f = link_format;
using Status = f::Status;

template <typename Code>
constexpr uint8_t number_of(Code code) {
  return static_cast<uint8_t>(code);
}

// Questions do nothing, and an old answer may be wrong by now; data carries its place.
bool is_done_once(uint32_t kind) {
  switch (kind) {
    case f::hello::kCode:
    case f::info::kCode:
    case f::reach::kCode:
    case f::faults::kCode:
    case f::config_get::kCode:
    case f::network_get::kCode:
    case f::touches::kCode:
    case f::sensed::kCode:
    case f::bank::kCode:
    case f::bank_data::kCode:
    case f::finger_area::kCode:
    case f::area_events::kCode:
    case f::table_data::kCode: return false;
    default: return true;
  }
}

}  // namespace

bool Requests::take(Conversation& with, const uint8_t* bytes, uint32_t size) {
  if (size < f::kHeadBytes) return false;
  const uint32_t kind = bytes[0], sequence = bytes[1];
  if ((kind & f::kResponse) != 0) return false;  // somebody else's answer
  device_.hear(&with);
  const uint32_t crc = crc32(bytes, size);
  const bool is_repeated = kind == with.last_kind && sequence == with.last_sequence &&
                           crc == with.last_crc && with.answer_size > 0;
  // What is being repeated was answered.
  if (is_repeated && is_done_once(kind)) return true;
  with_ = &with;
  with.answer[0] = static_cast<uint8_t>(kind | f::kResponse);
  with.answer[1] = static_cast<uint8_t>(sequence);
  with.answer_size = kAnswerHead;
  const Status status = handle(kind, {bytes + f::kHeadBytes, size - f::kHeadBytes});
  with.answer[2] = static_cast<uint8_t>(status);
  // What has to be asked again must be done then.
  with.last_kind = status == Status::kBusy ? 0U : kind;
  with.last_sequence = sequence;
  with.last_crc = crc;
  return true;
}

// Room for so many bytes more of the answer; answers are all shorter than their buffer.
uint8_t* Requests::append(uint32_t bytes) {
  uint8_t* const at = with_->answer.data() + with_->answer_size;
  with_->answer_size += bytes;
  return at;
}

Status Requests::handle(uint32_t kind, const Request& request) {
  switch (kind) {
    case f::hello::kCode: return greet(request);
    case f::info::kCode: return put_info();
    case f::reach::kCode: return put_reach();
    case f::faults::kCode: return put_faults();
    case f::config_get::kCode: return put_config();
    case f::network_get::kCode: return put_network();
    case f::network_set::kCode: return set_network(request);
    case f::table_begin::kCode: return begin_table(request);
    case f::table_data::kCode: return take_table(request);
    case f::table_commit::kCode:
      if (request.size != 0) return Status::kMalformed;
      return end_table<f::table_commit::Answer>(device_.table_commit());
    case f::table_previous::kCode:
      if (request.size != 0) return Status::kMalformed;
      return end_table<f::table_previous::Answer>(device_.table_previous());
    default: return handle_host(kind, request);
  }
}

Status Requests::greet(const Request& request) {
  namespace m = f::hello;
  using A = m::Answer;
  if (request.size < m::Request::kBytes) return Status::kMalformed;
  with_->allowed_driver = Conversation::kNoDriver;  // another program may begin here
  put(A{A::Major{f::kVersionMajor}, A::Minor{f::kVersionMinor}, A::Window{f::kWindow},
        A::MaxPayload{f::kMaxPayload}});
  const uint32_t major = m::read_request(request.fields, Take{}).major;
  return major == f::kVersionMajor ? Status::kOk : Status::kIncompatible;
}

Status Requests::begin_table(const Request& request) {
  namespace m = f::table_begin;
  constexpr uint32_t kFixed = m::Request::kBytes;
  if (request.size != kFixed + table_format::kHeaderBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  TableStatus refused = TableStatus::kOk;
  const Status status =
      device_.table_begin(asked.total, asked.crc, request.fields + kFixed, refused);
  put(m::Answer{m::Answer::TableStatus{number_of(refused)}});
  return status;
}

Status Requests::take_table(const Request& request) {
  namespace m = f::table_data;
  constexpr uint32_t kFixed = m::Request::kBytes;
  if (request.size <= kFixed) return Status::kMalformed;
  const uint32_t offset = m::read_request(request.fields, Take{}).offset;
  const Status status = device_.table_data(offset, request.fields + kFixed, request.size - kFixed);
  put(m::Answer{m::Answer::Next{device_.table_next()}});
  return status;
}

template <typename Answer>
Status Requests::end_table(Status status) {
  put(Answer{typename Answer::Slot{static_cast<uint8_t>(device_.slot())},
             typename Answer::TableStatus{number_of(device_.table_status())}});
  return status;
}

Status Requests::handle_host(uint32_t kind, const Request& request) {
  switch (kind) {
    case f::touch::kCode: return touch(request);
    case f::lift::kCode:
      device_.lift();
      put(f::lift::Answer{f::lift::Answer::PlayedMs{device_.played_ms()}});
      return Status::kOk;
    case f::frequency::kCode: return select_frequency(request);
    case f::waveform::kCode: return select_waveform(request);
    case f::driver_change::kCode: return allow_driver(request);
    case f::config_set::kCode: return set_config(request);
    case f::restart::kCode: device_.restart_soon(); return Status::kOk;
    case f::stream_begin::kCode: return begin_stream(request);
    case f::stream_data::kCode: return take_stream(request);
    case f::stream_end::kCode: device_.stream_end(); return Status::kOk;
    case f::live::kCode: return take_live(request);
    default: return handle_finger(kind, request);
  }
}

Status Requests::select_frequency(const Request& request) {
  namespace m = f::frequency;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  if (device_.state() != DeviceState::kIdle) return Status::kNotNow;
  const uint32_t millihertz = m::read_request(request.fields, Take{}).millihertz;
  const TableStatus status = device_.select_frequency(millihertz);
  put(m::Answer{m::Answer::TableStatus{number_of(status)}});
  return status == TableStatus::kOk ? Status::kOk : Status::kRefused;
}

Status Requests::select_waveform(const Request& request) {
  namespace m = f::waveform;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const uint8_t waveform = m::read_request(request.fields, Take{}).waveform;
  if (waveform >= kWaveforms) return Status::kMalformed;
  return device_.set_waveform(static_cast<Waveform>(waveform)) ? Status::kOk : Status::kRefused;
}

// A word of its own before a configuration that the board must have been rewired for.
Status Requests::allow_driver(const Request& request) {
  namespace m = f::driver_change;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  if (via_ != Via::kWire) return Status::kRefused;
  with_->allowed_driver = m::read_request(request.fields, Take{}).driver;
  return Status::kOk;
}

Status Requests::set_config(const Request& request) {
  using A = f::config_set::Answer;
  const uint32_t allowed = with_->allowed_driver;
  with_->allowed_driver = Conversation::kNoDriver;  // whatever becomes of this one
  if (!device_.is_quiet()) return Status::kNotNow;
  if (!device_.may_write()) return Status::kTooOften;
  const ConfigStatus status =
      device_.set_config(request.fields, request.size, via_ == Via::kWire, allowed);
  put(A{A::ConfigStatus{number_of(status)}});
  return status == ConfigStatus::kOk ? Status::kOk : Status::kRefused;
}

Status Requests::put_info() {
  using A = f::info::Answer;
  const Table& table = device_.table();
  const bool has_table = table.is_loaded();
  A::Fingerprint fingerprint{};
  A::Board board{};
  static_assert(sizeof board.value == table_format::kBoardNameBytes);
  if (has_table) {
    Take{}(table.identity(), fingerprint.value);
    Take{}(table.identity() + sizeof fingerprint.value, board.value);
  }
  A::RiseDk rise{};
  static_assert(rise.value.size() == kMaxChannels);
  for (uint32_t k = 0; k < rise.value.size(); ++k) {
    rise.value[k] = static_cast<uint16_t>(device_.heat().rise_dk(k));
  }
  put(A{
      A::State{number_of(device_.state())},
      A::TableStatus{number_of(device_.table_status())},
      A::ConfigStatus{number_of(device_.config_status())},
      A::PanelHealth{number_of(device_.input().health())},
      A::Slot{static_cast<uint8_t>(device_.slot())},
      A::Channels{device_.config().channels},
      A::Missed{static_cast<uint16_t>(device_.synthesis().missed())},
      A::UptimeMs{device_.now_ms()},
      A::Faults{device_.faults().count()},
      A::SupplyMa{device_.supply().mean_ma()},
      A::FrequencyMillihertz{has_table ? table.frequency_millihertz() : 0U},
      A::TableBytes{has_table ? table.total_bytes() : 0U},
      A::TableCrc{has_table ? table.crc() : 0U},
      fingerprint,
      board,
      rise,
      A::StackFree{device_.stack_free()},
      A::Standing{device_.faults().standing()},
      A::Erases{device_.erases()},
      A::Chip{static_cast<uint8_t>(device_.hal().chip)},
      A::Updates{device_.updates()},
  });
  return Status::kOk;
}

Status Requests::put_reach() {
  using A = f::reach::Answer;
  constexpr int32_t kFarAway = 1 << 30;
  const Table& table = device_.table();
  const Place least = table.is_loaded() ? table.on_board({-kFarAway, -kFarAway}) : Place{};
  const Place most = table.is_loaded() ? table.on_board({kFarAway, kFarAway}) : Place{};
  put(A{A::LeftUm{least.x_um}, A::BottomUm{least.y_um}, A::RightUm{most.x_um},
        A::TopUm{most.y_um}});
  return Status::kOk;
}

Status Requests::put_faults() {
  using A = f::faults::Answer;
  using E = f::faults::Entry;
  static_assert(kAnswerHead + A::kBytes + FaultLog::kKept * E::kBytes <= Conversation::kMostAnswer);
  const FaultLog& log = device_.faults();
  put(A{A::Count{static_cast<uint8_t>(log.kept())}});
  for (uint32_t k = 0; k < log.kept(); ++k) {
    const Fault& fault = log.at(k);
    put(E{E::Cause{number_of(fault.cause)}, E::Detail{fault.detail}, E::AtMs{fault.at_ms}});
  }
  return Status::kOk;
}

Status Requests::put_config() {
  static_assert(kAnswerHead + config_format::kRecordBytes <= Conversation::kMostAnswer);
  write_record(device_.config(), 0, append(config_format::kRecordBytes));
  return Status::kOk;
}

Status Requests::put_network() {
  using A = f::network_get::Answer;
  const NetworkState& state = network_;
  const bool has_address = state.is_on && state.address != 0;
  A::Ssid ssid{};
  static_assert(ssid.value.size() < decltype(state.ssid){}.size());
  for (uint32_t k = 0; k < ssid.value.size(); ++k) ssid.value[k] = state.ssid[k];
  put(A{A::State{static_cast<uint8_t>(state.is_on ? (has_address ? 2U : 1U) : 0U)},
        A::Port{state.port}, A::Address{state.address}, A::Accepted{state.accepted},
        A::Rejected{state.rejected}, ssid});
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

Status Requests::begin_stream(const Request& request) {
  using R = f::stream_begin::Request;
  std::array<uint8_t, R::kBytes> fields{};
  if (request.size != R::kBytes && request.size != R::kBytes - 1U) return Status::kMalformed;
  for (uint32_t k = 0; k < request.size; ++k) fields[k] = request.fields[k];
  const auto asked = f::stream_begin::read_request(fields.data(), Take{});
  if (asked.target < f::kLeastTarget || asked.target > f::kMostTarget) return Status::kMalformed;
  const bool has_bridges = device_.config().driver == kBridge;
  // Hosts from before there were bridges leave it out, and do not know the status below.
  if (request.size != R::kBytes && has_bridges) return Status::kMalformed;
  if ((asked.is_signed != 0) != has_bridges) return Status::kOtherDriver;
  return device_.stream_begin(asked.target) ? Status::kOk : Status::kNotNow;
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
  using A = f::stream_data::Answer;
  put(A{A::Taken{static_cast<uint16_t>(taken)},
        A::Filled{static_cast<uint16_t>(device_.stream().filled())}});
  return device_.state() == DeviceState::kStreaming ? Status::kOk : Status::kNotNow;
}

Status Requests::take_live(const Request& request) {
  namespace m = f::live;
  const uint32_t channels = device_.config().channels;
  if (request.size != m::Request::kBytes + m::Entry::kBytes * channels) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  if (asked.waveform >= kWaveforms || asked.millihertz < table_format::kMinFrequencyMillihertz ||
      asked.millihertz > table_format::kMaxFrequencyMillihertz) {
    return Status::kMalformed;
  }
  Drive drive{};
  for (uint32_t k = 0; k < channels; ++k) {
    const uint8_t* const at = request.fields + m::Request::kBytes + m::Entry::kBytes * k;
    const m::Entry gain = m::read_entry(at, Take{});
    drive[k] = {gain.in_phase_q15, gain.quadrature_q15};
  }
  if (device_.play_live(drive, asked.millihertz, static_cast<Waveform>(asked.waveform))) {
    return Status::kOk;
  }
  return device_.state() == DeviceState::kStreaming ? Status::kBusy : Status::kNotNow;
}

}  // namespace chladni
