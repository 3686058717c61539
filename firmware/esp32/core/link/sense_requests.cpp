// What a host asks of coils that measure each other.
#include "core/generated/link_messages.hpp"
#include "core/link/requests.hpp"

namespace chladni {

namespace f = link_format;
using Status = f::Status;

Status Requests::handle_sense(uint32_t kind, const Request& request) {
  switch (kind) {
    case f::sense::kCode: return sense(request);
    case f::sensed::kCode: return put_sensed();
    case f::motion_sense::kCode: return sense_motion(request);
    case f::motion::kCode: return put_motion(request);
    default: return handle_bank(kind, request);
  }
}

namespace {

bool can_play(const Device& device, uint32_t playing, uint32_t multiple, uint32_t level_q15) {
  return playing < device.config().channels && multiple >= f::kLeastMultiple &&
         multiple <= f::kMostMultiple && multiple % 2U == 0 && level_q15 <= 32767U;
}

}  // namespace

Status Requests::sense(const Request& request) {
  namespace m = f::sense;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  const bool is_fine = can_play(device_, asked.playing, asked.multiple, asked.level_q15) &&
                       asked.readings >= 1U && asked.readings <= f::kMostRead;
  if (!is_fine) return Status::kMalformed;
  return device_.sense(
      {asked.playing, asked.multiple, asked.level_q15, asked.settle_ms, asked.readings, 0U});
}

Status Requests::sense_motion(const Request& request) {
  namespace m = f::motion_sense;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  const bool is_fine = can_play(device_, asked.playing, asked.multiple, asked.level_q15) &&
                       asked.count >= 1U && asked.count <= f::kMostMotions;
  if (!is_fine) return Status::kMalformed;
  return device_.sense(
      {asked.playing, asked.multiple, asked.level_q15, asked.settle_ms, 0U, asked.count});
}

Status Requests::put_sensed() {
  using A = f::sensed::Answer;
  using E = f::sensed::Entry;
  static_assert(kAnswerHead + A::kBytes + kMaxChannels * E::kBytes <= Conversation::kMostAnswer);
  const CoilSense& sense = device_.coil_sense();
  const bool is_of_coils = sense.request().motions == 0;
  const uint32_t count = is_of_coils && sense.state() == SenseState::kDone ? sense.count() : 0U;
  put(A{A::State{static_cast<uint8_t>(sense.state())},
        A::Playing{static_cast<uint8_t>(sense.request().playing)},
        A::Multiple{static_cast<uint16_t>(sense.request().multiple)},
        A::Session{static_cast<uint16_t>(sense.session())},
        A::AmplitudeQ16{static_cast<uint16_t>(sense.amplitude_q16())},
        A::Count{static_cast<uint8_t>(count)}});
  for (uint32_t k = 0; k < count; ++k) {
    const CoilReading& own = sense.at(k);
    put(E{E::Coil{own.coil}, E::InPhaseQ5{own.in_phase_q5}, E::QuadratureQ5{own.quadrature_q5},
          E::Sum{own.sum}, E::SquaresBy256{own.squares_by_256}});
  }
  return Status::kOk;
}

Status Requests::put_motion(const Request& request) {
  namespace m = f::motion;
  using A = m::Answer;
  using E = m::Entry;
  static_assert(kAnswerHead + A::kBytes + f::kMotionsAtOnce * E::kBytes <=
                Conversation::kMostAnswer);
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const uint32_t first = m::read_request(request.fields, Take{}).first;
  const CoilSense& sense = device_.coil_sense();
  const Accelerometer& found = sense.accelerometer();
  const bool is_of_motion = sense.request().motions > 0;
  const uint32_t last = is_of_motion && sense.state() == SenseState::kDone ? found.count() : 0U;
  const uint32_t left = first < last ? last - first : 0U;
  const uint32_t count = left < f::kMotionsAtOnce ? left : f::kMotionsAtOnce;
  put(A{A::State{static_cast<uint8_t>(is_of_motion ? sense.state() : SenseState::kNone)},
        A::Playing{static_cast<uint8_t>(sense.request().playing)},
        A::Multiple{static_cast<uint16_t>(sense.request().multiple)},
        A::AmplitudeQ16{static_cast<uint16_t>(sense.amplitude_q16())},
        A::Model{static_cast<uint8_t>(found.model())}, A::Count{static_cast<uint8_t>(count)}});
  for (uint32_t k = first; k < first + count; ++k) {
    put(E{E::Z{found.at(k).z}, E::FoundAt{found.at(k).found_at}});
  }
  return Status::kOk;
}

}  // namespace chladni
