// The service over gRPC, on a fake backend.
#pragma once

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "server/api/grpc_server.h"
#include "server/api/simulation_service.h"
#include "server/core/clock.h"
#include "server/session/session_registry.h"
#include "tests/scheduler/fake_backend.h"

namespace drape::test {

class FakeServer {
 public:
  FakeServer() { server_ = api::GrpcServer::Start({.listen = "127.0.0.1:0"}, {&service_}).value(); }
  ~FakeServer() { Stop(); }

  // A connection of its own, made before the first call: gRPC 1.51 may lose the errno of its
  // connect to an allocation of the same thread, gives up that attempt, and makes another after a
  // second (https://github.com/grpc/grpc/pull/35064).
  std::unique_ptr<v1::SimulationService::Stub> Connect() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const std::shared_ptr<grpc::Channel> channel =
        grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(server_->port()),
                                  grpc::InsecureChannelCredentials(), arguments);
    EXPECT_TRUE(
        channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::minutes(1)));
    return v1::SimulationService::NewStub(channel);
  }
  // In the order of draped.
  void Stop() {
    pictures_.Stop();
    scheduler_->Drain(0);
    server_->Shutdown(std::chrono::milliseconds(100));
  }
  FakeDevice& device() { return *device_; }
  Scheduler& scheduler() { return *scheduler_; }
  uint64_t unread_bytes() const { return unread_->used_bytes(); }
  uint32_t runs() const { return context_.streams->runs; }

 private:
  static Result<std::unique_ptr<render::Renderer>> NoRenderer() {
    return Status(StatusCode::kFailedPrecondition, "NO_RENDERER", "there are no pictures here");
  }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  SteadyClock clock_;
  std::unique_ptr<Scheduler> scheduler_ =
      Scheduler::Start(FakeBackendFactory(device_), {}, clock_).value();
  SessionRegistry sessions_{*scheduler_, {}, clock_, "test"};
  api::WorkerPool builders_{2, 1024};
  render::RenderThread pictures_{NoRenderer, {}};
  std::shared_ptr<ByteBudget> unread_ = api::MakeUnreadBudget({});
  api::ServiceContext context_{*scheduler_, sessions_, builders_, pictures_, clock_,
                               {},          "test",    "test",    unread_};
  api::SimulationService service_{context_};
  std::unique_ptr<api::GrpcServer> server_;
};

}  // namespace drape::test
