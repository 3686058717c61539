// What a host asks of fingers: those it holds itself, and what each of the panel's plays.
#include "core/base/bytes.hpp"
#include "core/generated/link_messages.hpp"
#include "core/link/requests.hpp"

namespace chladni {

namespace f = link_format;
using Status = f::Status;

Status Requests::touch(const Request& request) {
  namespace m = f::touch;
  using A = m::Answer;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  if (!device_.table().is_loaded()) return Status::kNotNow;
  const m::Request asked = m::read_request(request.fields, Take{});
  const Place place = device_.touch({asked.x_um, asked.y_um}, with_);
  put(A{A::XUm{place.x_um}, A::YUm{place.y_um}});
  return Status::kOk;
}

// Without responses there is no drive for a second one.
Status Requests::touch_finger(const Request& request) {
  namespace m = f::finger_touch;
  using A = m::Answer;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  if (asked.finger >= kMaxFingers) return Status::kMalformed;
  const Table& table = device_.table();
  if (!table.is_loaded() || (asked.finger > 0 && !table.has_responses())) return Status::kNotNow;
  const Place place = device_.touch({asked.x_um, asked.y_um}, with_, asked.finger);
  put(A{A::XUm{place.x_um}, A::YUm{place.y_um}});
  return Status::kOk;
}

Status Requests::lift_finger(const Request& request) {
  namespace m = f::finger_lift;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const uint32_t finger = m::read_request(request.fields, Take{}).finger;
  if (finger >= kMaxFingers) return Status::kMalformed;
  device_.lift(finger);
  return Status::kOk;
}

Status Requests::handle_finger(uint32_t kind, const Request& request) {
  switch (kind) {
    case f::touches::kCode: return put_touches();
    case f::voice::kCode: return set_voice(request);
    case f::signal_voice::kCode: return set_signal_voice(request);
    case f::signal_limit::kCode: return limit_signal(request);
    case f::signal_data::kCode: return take_signal(request);
    case f::finger_touch::kCode: return touch_finger(request);
    case f::finger_lift::kCode: return lift_finger(request);
    default: return handle_sense(kind, request);
  }
}

Status Requests::set_voice(const Request& request) {
  namespace m = f::voice;
  namespace t = table_format;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  const bool is_known = asked.millihertz == 0 || (asked.millihertz >= t::kMinFrequencyMillihertz &&
                                                  asked.millihertz <= t::kMaxFrequencyMillihertz);
  if (asked.finger >= kMaxFingers || asked.level_q15 > 32767U || !is_known) {
    return Status::kMalformed;
  }
  device_.set_voice(asked.finger, {asked.millihertz, asked.level_q15, false});
  return Status::kOk;
}

Status Requests::set_signal_voice(const Request& request) {
  namespace m = f::signal_voice;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  if (asked.finger >= kMaxFingers || asked.level_q15 > 32767U) return Status::kMalformed;
  device_.set_voice(asked.finger, {0, asked.level_q15, true});
  return Status::kOk;
}

Status Requests::limit_signal(const Request& request) {
  namespace m = f::signal_limit;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  if (asked.finger >= kMaxFingers) return Status::kMalformed;
  return device_.limit_signal(asked.finger, asked.most_10nm) ? Status::kOk : Status::kNotNow;
}

// As much as the ring has room for: the host sends the rest later.
Status Requests::take_signal(const Request& request) {
  namespace m = f::signal_data;
  using A = m::Answer;
  constexpr uint32_t kFixed = m::Request::kBytes;
  if (request.size < kFixed || (request.size - kFixed) % 2U != 0) return Status::kMalformed;
  const uint32_t finger = m::read_request(request.fields, Take{}).finger;
  if (finger >= kMaxFingers) return Status::kMalformed;
  if (device_.has_bank_finger(finger)) return Status::kNotNow;
  SignalRing& ring = device_.signal(finger);
  uint32_t taken = 0;
  for (uint32_t at = kFixed; at < request.size; at += 2U, ++taken) {
    if (!ring.push(static_cast<int16_t>(read_u16(request.fields + at)))) break;
  }
  put(A{A::Taken{static_cast<uint16_t>(taken)}, A::Filled{static_cast<uint16_t>(ring.filled())}});
  return Status::kOk;
}

Status Requests::put_touches() {
  using A = f::touches::Answer;
  using E = f::touches::Entry;
  static_assert(kAnswerHead + A::kBytes + kMaxFingers * E::kBytes <= Conversation::kMostAnswer);
  const Touches touches = device_.input().touches();
  const FingerDrives& drives = device_.finger_drives();
  put(A{A::Count{static_cast<uint8_t>(count_of(touches))}});
  for (uint32_t slot = 0; slot < kMaxFingers; ++slot) {
    const Contact& one = touches[slot];
    if (!one.is_down) continue;
    put(E{E::Slot{static_cast<uint8_t>(slot)}, E::XUm{one.place.x_um}, E::YUm{one.place.y_um},
          E::Isolation{static_cast<uint16_t>(drives.isolation(slot))},
          E::OfLoudest{static_cast<uint16_t>(drives.of_loudest(slot))}});
  }
  return Status::kOk;
}

}  // namespace chladni
