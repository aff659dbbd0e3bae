// Cloths that stand for the kernels of the backend gl: those of the benchmarks, and one per
// feature. `drape_bench kernels` counts what their kernels cost, `drape_bench speed
// --parts=kernels` measures it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/solver/gl_compute/strip_solve.h"
#include "tests/support/scenes.h"

namespace drape::bench {

struct NamedCloth {
  std::string name;
  test::Scene scene;
  StripSolve strip_solve = StripSolve::kReduction;  // as on hardware
  bool tells_impulses = false;
  uint32_t steps = 30;     // before it is measured, so that it moves and touches what it will
  bool is_counted = true;  // else only measured
};

std::vector<NamedCloth> NamedCloths();

}  // namespace drape::bench
