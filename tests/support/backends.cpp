#include "tests/support/backends.h"

#include <map>

#include "server/core/check.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu_reference/reference_backend.h"

namespace drape::test {

std::vector<std::string> BackendNames() {
  return {"reference", "cpu"};
}

std::vector<std::string> FloatBackendNames() {
  return {"cpu"};
}

std::unique_ptr<Backend> MakeBackend(const std::string& name) {
  if (name == "reference") return CreateReferenceBackend();
  DRAPE_CHECK(name == "cpu", "no backend is called " + name);
  return CreateCpuBackend();
}

Backend& SharedBackend(const std::string& name) {
  // Never destroyed: a device must not go down after the libraries that it needs.
  static auto& backends = *new std::map<std::string, std::unique_ptr<Backend>>;
  std::unique_ptr<Backend>& backend = backends[name];
  if (!backend) backend = MakeBackend(name);
  return *backend;
}

}  // namespace drape::test
