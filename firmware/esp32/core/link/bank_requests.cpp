// What a host asks of effect banks: to replace the one in use, what is in it, and what fingers did.
#include "core/base/bytes.hpp"
#include "core/effects/areas.hpp"
#include "core/generated/link_messages.hpp"
#include "core/link/requests.hpp"

namespace chladni {

namespace f = link_format;
using Status = f::Status;

Status Requests::handle_bank(uint32_t kind, const Request& request) {
  switch (kind) {
    case f::bank_begin::kCode: return begin_bank(request);
    case f::bank_data::kCode: return take_bank(request);
    case f::bank_commit::kCode: return request.size == 0 ? end_bank() : Status::kMalformed;
    case f::bank::kCode: return put_bank();
    case f::bank_area::kCode: return put_area(request);
    case f::bank_effect::kCode: return put_effect(request);
    case f::effect::kCode: return play_effect(request);
    case f::finger_area::kCode: return put_finger_area(request);
    case f::area_events::kCode: return put_area_events(request);
    default: return Status::kUnknown;
  }
}

Status Requests::begin_bank(const Request& request) {
  namespace m = f::bank_begin;
  constexpr uint32_t kFixed = m::Request::kBytes;
  if (request.size != kFixed + bank_format::kHeaderBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  BankStatus refused = BankStatus::kOk;
  const Status status =
      device_.bank_begin(asked.total, asked.crc, request.fields + kFixed, refused);
  put(m::Answer{m::Answer::BankStatus{static_cast<uint8_t>(refused)}});
  return status;
}

Status Requests::take_bank(const Request& request) {
  namespace m = f::bank_data;
  constexpr uint32_t kFixed = m::Request::kBytes;
  if (request.size <= kFixed) return Status::kMalformed;
  const uint32_t offset = m::read_request(request.fields, Take{}).offset;
  const Status status = device_.bank_data(offset, request.fields + kFixed, request.size - kFixed);
  put(m::Answer{m::Answer::Next{device_.bank_next()}});
  return status;
}

Status Requests::end_bank() {
  using A = f::bank_commit::Answer;
  const Status status = device_.bank_commit();
  const StoredBank& stored = device_.stored_bank();
  put(A{A::Slot{static_cast<uint8_t>(stored.store().slot())},
        A::BankStatus{static_cast<uint8_t>(stored.status())}});
  return status;
}

Status Requests::put_bank() {
  using A = f::bank::Answer;
  const StoredBank& stored = device_.stored_bank();
  const Bank& bank = stored.bank();
  const bool is_there = bank.is_loaded();
  A::Name name{};
  if (is_there) Take{}(bank.name(), name.value);
  put(A{A::BankStatus{static_cast<uint8_t>(stored.status())},
        A::Effects{static_cast<uint8_t>(is_there ? bank.effects() : 0U)},
        A::Areas{static_cast<uint8_t>(is_there ? bank.areas() : 0U)},
        A::Bytes{is_there ? bank.total_bytes() : 0U}, A::Crc{is_there ? bank.crc() : 0U}, name});
  return Status::kOk;
}

Status Requests::put_area(const Request& request) {
  namespace m = f::bank_area;
  using A = m::Answer;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const Bank& bank = device_.stored_bank().bank();
  const uint32_t number = m::read_request(request.fields, Take{}).area;
  if (!bank.is_loaded() || number >= bank.areas()) return Status::kMalformed;
  A::Name name{};
  Take{}(bank.area_name(number), name.value);
  const Box box = box_of(bank.area(number));
  put(A{name, A::LeftUm{box.least.x_um}, A::BottomUm{box.least.y_um}, A::RightUm{box.most.x_um},
        A::TopUm{box.most.y_um}});
  return Status::kOk;
}

Status Requests::put_effect(const Request& request) {
  namespace m = f::bank_effect;
  using A = m::Answer;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const Bank& bank = device_.stored_bank().bank();
  const uint32_t number = m::read_request(request.fields, Take{}).effect;
  if (!bank.is_loaded() || number >= bank.effects()) return Status::kMalformed;
  A::Name name{};
  Take{}(bank.effect_name(number), name.value);
  put(A{name, A::Lasts{static_cast<uint16_t>(bank.effect(number).lasts)}});
  return Status::kOk;
}

Status Requests::play_effect(const Request& request) {
  namespace m = f::effect;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  if (asked.finger >= kMaxFingers || asked.level_q15 > 32767U) return Status::kMalformed;
  const bool is_played = device_.play_effect(asked.finger, asked.effect, asked.level_q15);
  return is_played ? Status::kOk : Status::kNotNow;
}

Status Requests::put_finger_area(const Request& request) {
  namespace m = f::finger_area;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const uint32_t finger = m::read_request(request.fields, Take{}).finger;
  if (finger >= kMaxFingers) return Status::kMalformed;
  put(m::Answer{m::Answer::Area{static_cast<uint8_t>(device_.area_of(finger))}});
  return Status::kOk;
}

Status Requests::put_area_events(const Request& request) {
  namespace m = f::area_events;
  using A = m::Answer;
  using E = m::Entry;
  static_assert(kAnswerHead + A::kBytes + f::kMostEvents * E::kBytes <= Conversation::kMostAnswer);
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const AreaEvents& events = device_.area_events();
  const uint32_t asked = m::read_request(request.fields, Take{}).after;
  // What was dropped is left out, and so is what a device said before it started again.
  uint32_t at = asked < events.begin() || asked > events.end() ? events.begin() : asked;
  const uint32_t left = events.end() - at;
  const uint32_t count = left < f::kMostEvents ? left : f::kMostEvents;
  put(A{A::Next{at + count}, A::Count{static_cast<uint8_t>(count)}});
  for (uint32_t k = 0; k < count; ++k, ++at) {
    const AreaRecord& one = events.at(at);
    put(E{E::AtMs{one.at_ms}, E::What{static_cast<uint8_t>(one.what)},
          E::Finger{static_cast<uint8_t>(one.slot)}, E::Area{static_cast<uint8_t>(one.area)},
          E::XUm{one.place.x_um}, E::YUm{one.place.y_um}});
  }
  return Status::kOk;
}

}  // namespace chladni
