// What a host asks of coils that measure each other.
#include "core/generated/link_messages.hpp"
#include "core/link/requests.hpp"

namespace chladni {

namespace f = link_format;
using Status = f::Status;

Status Requests::handle_sense(uint32_t kind, const Request& request) {
  if (kind == f::sense::kCode) return sense(request);
  return kind == f::sensed::kCode ? put_sensed() : handle_bank(kind, request);
}

Status Requests::sense(const Request& request) {
  namespace m = f::sense;
  if (request.size != m::Request::kBytes) return Status::kMalformed;
  const m::Request asked = m::read_request(request.fields, Take{});
  const bool is_fine = asked.playing < device_.config().channels &&
                       asked.multiple >= f::kLeastMultiple && asked.multiple <= f::kMostMultiple &&
                       asked.multiple % 2U == 0 && asked.level_q15 <= 32767U &&
                       asked.readings >= 1U && asked.readings <= f::kMostRead;
  if (!is_fine) return Status::kMalformed;
  return device_.sense(
      {asked.playing, asked.multiple, asked.level_q15, asked.settle_ms, asked.readings});
}

Status Requests::put_sensed() {
  using A = f::sensed::Answer;
  using E = f::sensed::Entry;
  static_assert(kAnswerHead + A::kBytes + kMaxChannels * E::kBytes <= Conversation::kMostAnswer);
  const CoilSense& sense = device_.coil_sense();
  const uint32_t count = sense.state() == SenseState::kDone ? sense.count() : 0U;
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

}  // namespace chladni
