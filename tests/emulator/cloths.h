// Small cloths that together have every stage and feature of the kernels.
#pragma once

#include <string>
#include <vector>

#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/emulator/capture.h"
#include "tests/support/scenes.h"

namespace drape::emulator {

struct EmulatedCloth {
  test::Scene scene;
  GlTuning tuning{};
  uint32_t steps = 1;
  // For hardware: the kernels with this define too, which the software renderer does not know.
  std::string define{};
  bool tells_impulses = false;
};

std::vector<EmulatedCloth> ResidentCloths();
// Of more particles than fit a work group.
std::vector<EmulatedCloth> TiledCloths();
// Small ones, which are tiled because they touch themselves.
std::vector<EmulatedCloth> TouchingCloths();

// All dispatches of its steps, measured ones, and of a read.
std::vector<CapturedDispatch> DispatchesOf(const EmulatedCloth& cloth);

}  // namespace drape::emulator
