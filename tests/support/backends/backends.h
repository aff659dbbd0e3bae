// Every backend by its name, for tests that run one body over all of them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/solver/backend.h"

namespace drape::test {

// "reference" first: the one that the others are compared with.
std::vector<std::string> BackendNames();

// Those that step every cloth themselves: "gl" leaves worlds, bodies, and the edges and triangles
// that touch colliders to "cpu" (PairBackends).
std::vector<std::string> OwnBackendNames();

// The backends in single precision.
std::vector<std::string> FloatBackendNames();

// Single precision, and "gl_reduction": "gl" that solves short strips by cyclic reduction even on a
// device without subgroups, with barriers, and "gl_both_ends": "gl" that solves strips from both
// ends, as hardware solves long ones. For tests of strips.
std::vector<std::string> StripBackendNames();

// Whether a backend may solve strips by cyclic reduction, wholly or, from both ends, at first.
bool HasReduction(const Backend& backend);

// A new backend on the calling thread: of those above, or "gl_elimination", for measurements of the
// gain. One that cannot be created ends the process with the reason: a test never passes because
// its backend was missing.
std::unique_ptr<Backend> MakeBackend(const std::string& name);

// One instance per process, made at first use, for tests that cannot afford a new device. Only on
// the main thread; destroy what you create.
Backend& SharedBackend(const std::string& name);

// Names the cases of a suite whose parameter is a backend's name (INSTANTIATE_TEST_SUITE_P).
template <class TestParamInfo>
std::string NameOfCase(const TestParamInfo& info) {
  return info.param;
}

}  // namespace drape::test
