// The drives of several fingers on another processor: what they take in instructions, and what
// comes out, for tools/finger_instructions.py. FINGERS and CHANNELS are set there.
#include <cstdint>

#include "core/fingers/drive_solver.hpp"
#include "qemu/runtime.hpp"

namespace {

chladni::fingers::DriveSolver<float> solver;

uint32_t seed = 1;

// Between -1 and 1, a linear congruential sequence.
float next() {
  seed = seed * 1664525U + 1013904223U;
  return static_cast<float>(static_cast<int32_t>(seed)) * (1.0F / 2147483648.0F);
}

chladni::fingers::Complex<float> next_number(float scale) {
  const float re = next() * scale;
  return {re, next() * scale};
}

// Responses as large as a plate's, fingers that press, no threshold: every share is felt, and a
// second λ is tried.
void fill(float regularisation) {
  seed = 1;
  auto& set = solver.set();
  set = {};
  set.count = FINGERS;
  set.channels = CHANNELS;
  for (uint32_t j = 0; j < FINGERS; ++j) {
    for (auto& point : set.fingers[j].points) {
      for (uint32_t k = 0; k < CHANNELS; ++k) point[k] = next_number(1e-5F);
    }
    set.fingers[j].own = {3e-5F, 0.0F};
    set.fingers[j].level_n = 1.0F;
    set.fingers[j].regularisation = regularisation;
  }
  for (uint32_t k = 0; k < CHANNELS * (CHANNELS + 1) / 2; ++k) {
    set.coupling[k] = next_number(1e5F / CHANNELS);
  }
  set.stiffness = {1e4F, 2e3F};
}

struct Taken {
  uint32_t sum = 0;
  uint32_t most = 0;
};

Taken solve(float regularisation, uint32_t overhead) {
  fill(regularisation);
  Taken taken;
  solver.begin();
  for (bool goes_on = true; goes_on;) {
    const uint32_t begin = counter();
    goes_on = solver.step();
    const uint32_t slice = counter() - begin - overhead;
    taken.sum += slice;
    if (slice > taken.most) taken.most = slice;
  }
  return taken;
}

}  // namespace

int main() {
  const uint32_t nothing = counter();
  const uint32_t overhead = counter() - nothing;
  const Taken chosen = solve(0.0F, overhead);
  say("chosen_sum", chosen.sum);
  say("chosen_most", chosen.most);
  const Taken one = solve(1e-3F, overhead);
  say("one_sum", one.sum);
  say("one_most", one.most);
  // Of the last finger, 2^15 and more for no sign to be lost.
  for (uint32_t k = 0; k < CHANNELS; ++k) {
    const chladni::fingers::Complex<float> gain = solver.drive(FINGERS - 1).gains[k];
    say("gain", static_cast<uint32_t>(static_cast<int32_t>((gain.re + 2.0F) * 32768.0F)));
    say("gain", static_cast<uint32_t>(static_cast<int32_t>((gain.im + 2.0F) * 32768.0F)));
  }
  say("ram", sizeof solver);
  return 0;
}
