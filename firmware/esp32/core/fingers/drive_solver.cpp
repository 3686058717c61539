#include "core/fingers/drive_solver.hpp"

#include "core/fingers/drive_solver_steps.hpp"

namespace chladni::fingers {

template class DriveSolver<float>;

}  // namespace chladni::fingers
