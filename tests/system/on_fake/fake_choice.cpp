// draped on the fake backend, for what ThreadSanitizer is to see of the service alone: neither
// oneTBB, whose synchronisation it does not see, nor a graphics driver.
#include "server/backend_choice.h"
#include "tests/scheduler/fake_backend.h"

namespace drape {

int PrintDevices() {
  return 1;
}

Status AwaitGpu(const Config&) {
  return Status::Ok();
}

Result<std::unique_ptr<Backend>> MakeBackend(const Config&, std::optional<gl::ShareHandle>&) {
  return FakeBackendFactory(std::make_shared<FakeDevice>())();
}

Result<std::unique_ptr<render::Renderer>> MakeRenderer(const Config&,
                                                       const std::optional<gl::ShareHandle>&) {
  return Status(StatusCode::kFailedPrecondition, "NO_EGL_DEVICE", "the fake backend draws nothing");
}

}  // namespace drape
