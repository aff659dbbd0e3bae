#include "tests/support/backends/backends.h"

#include <map>
#include <utility>

#include "server/core/check.h"
#include "server/solver/backend_pair.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu_reference/reference_backend.h"
#include "server/solver/gl_compute/gl_tuning.h"

namespace drape::test {

std::vector<std::string> BackendNames() {
  return {"reference", "cpu", "gl"};
}

std::vector<std::string> OwnBackendNames() {
  return {"reference", "cpu"};
}

std::vector<std::string> FloatBackendNames() {
  return {"cpu", "gl"};
}

std::vector<std::string> StripBackendNames() {
  return {"cpu", "gl", "gl_reduction", "gl_both_ends"};
}

bool HasReduction(const Backend& backend) {
  const std::string device = backend.Describe().device;
  return device.find("cyclic reduction") != std::string::npos ||
         device.find("from both ends") != std::string::npos;
}

std::unique_ptr<Backend> MakeBackend(const std::string& name) {
  if (name == "reference") return CreateReferenceBackend();
  if (name == "cpu") return CreateCpuBackend();
  GlTuning tuning;
  if (name == "gl_reduction") {
    tuning.strip_solve = StripSolve::kReductionWithBarriers;
  } else if (name == "gl_both_ends") {
    tuning.strip_solve = StripSolve::kFromBothEnds;
  } else if (name == "gl_elimination") {
    tuning.strip_solve = StripSolve::kElimination;
  } else {
    DRAPE_CHECK(name == "gl", "no backend is called " + name);
  }
  auto backend = CreateTunedGlBackend({}, tuning);
  DRAPE_CHECK(backend.ok(), backend.status().ToString());
  return PairBackends(std::move(*backend), CreateCpuBackend());
}

Backend& SharedBackend(const std::string& name) {
  // Never destroyed: a device must not be destroyed after the libraries that it needs.
  static auto& backends = *new std::map<std::string, std::unique_ptr<Backend>>;
  std::unique_ptr<Backend>& backend = backends[name];
  if (!backend) backend = MakeBackend(name);
  return *backend;
}

}  // namespace drape::test
