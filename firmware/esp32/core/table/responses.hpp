// What a table knows of the plate at a place: for the main loop, which may reckon in floats.
#pragma once

#include <array>

#include "core/synthesis/drive.hpp"

namespace chladni {

struct ComplexFloat {
  float re;
  float im;
};

// Displacement per newton, m/N: of each coil, and of a fingertip by a push of its own.
struct PlaceResponses {
  std::array<ComplexFloat, kMaxChannels> coils;
  ComplexFloat own;
};

// What drives reckon with; 0 where it is not known.
struct ReckonedFinger {
  float full_force_n;      // peak, of one coil in a touch without end
  float threshold_m;       // RMS over a resting fingertip, peak in time
  ComplexFloat stiffness;  // force over displacement of one that presses, N/m
};

}  // namespace chladni
