// The scenes whose states are recorded: between them every stage, switch and variant of the step.
#pragma once

#include <vector>

#include "tests/support/scenes.h"

namespace drape::test {

// Each has a name of its own.
std::vector<Scene> GoldenScenes();
// Few of them, for a device whose kernels take long to compile: those with a kernel each that the
// others share parts with.
std::vector<Scene> FewGoldenScenes();

// One of several cloths of a scene, no two alike but for the model. The first is the scene itself.
Scene GoldenCopy(Scene scene, uint32_t index);

}  // namespace drape::test
