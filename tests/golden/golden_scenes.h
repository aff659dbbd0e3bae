// The scenes whose states are recorded: between them every stage, switch and variant of the step.
#pragma once

#include <vector>

#include "tests/support/scenes.h"

namespace drape::test {

// Each has a name of its own.
std::vector<Scene> GoldenScenes();
// A few of them, for a device whose kernels take long to compile: each has a kernel of its own that
// shares parts with other scenes' kernels.
std::vector<Scene> FewGoldenScenes();

// One of several cloths of a scene, all with the same model and otherwise different. The first is
// the scene itself.
Scene GoldenCopy(Scene scene, uint32_t index);

}  // namespace drape::test
