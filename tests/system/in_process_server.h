// The whole server inside the test's process, where a test can hold its device thread.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "server/api/grpc_server.h"
#include "server/api/simulation_service.h"
#include "server/core/clock.h"
#include "server/render/gl_draw/gl_renderer.h"
#include "server/session/session_registry.h"
#include "tests/support/backends/backends.h"

namespace drape::test {

class InProcessServer {
 public:
  // Any backend of tests/support by its name.
  explicit InProcessServer(const std::string& backend, const SchedulerLimits& limits = {},
                           const api::RequestLimits& request_limits = {})
      : scheduler_(StartScheduler(backend, limits, clock_)),
        sessions_(*scheduler_, {}, clock_, "test"),
        builders_(2, 1024),
        pictures_([] { return render::CreateGlRenderer({}); }, {}),
        service_(
            {*scheduler_, sessions_, builders_, pictures_, clock_, request_limits, "test", "test"}),
        server_(api::GrpcServer::Start({.listen = "127.0.0.1:0"}, {&service_}).value()) {}

  ~InProcessServer() {
    pictures_.Stop();
    scheduler_->Drain(0);
    server_->Shutdown(std::chrono::milliseconds(100));
  }

  std::unique_ptr<v1::SimulationService::Stub> NewStub() {
    return v1::SimulationService::NewStub(server_->InProcessChannel());
  }
  Scheduler& scheduler() { return *scheduler_; }
  api::WorkerPool& builders() { return builders_; }
  api::GrpcServer& server() { return *server_; }

 private:
  static std::unique_ptr<Scheduler> StartScheduler(const std::string& backend,
                                                   const SchedulerLimits& limits,
                                                   const Clock& clock) {
    return Scheduler::Start(
               [backend]() -> Result<std::unique_ptr<Backend>> { return MakeBackend(backend); },
               limits, clock)
        .value();
  }

  SteadyClock clock_;
  std::unique_ptr<Scheduler> scheduler_;
  SessionRegistry sessions_;
  api::WorkerPool builders_;
  render::RenderThread pictures_;
  api::SimulationService service_;
  std::unique_ptr<api::GrpcServer> server_;
};

}  // namespace drape::test
