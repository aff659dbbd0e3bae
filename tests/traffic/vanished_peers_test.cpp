// Peers that vanish without a word while nothing but signs of life is sent: both sides notice.
#include <drape/client.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <string>
#include <thread>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/cutting_proxy.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using std::chrono::seconds;

constexpr size_t kUncut = size_t{1} << 50;
// Of keepalives of 1 s: more than the two that gRPC sends by default before it waits for something
// else to be sent.
constexpr seconds kManySigns{5};
// The next sign of life, its time-out of 1 s, and patience for a busy machine.
constexpr seconds kNoticed{10};

// One session, whose steps do not end.
class SilentService final : public v1::SimulationService::Service {
 public:
  grpc::Status CreateSession(grpc::ServerContext*, const v1::CreateSessionRequest*,
                             v1::Session* session) override {
    session->set_name("sessions/silent");
    session->set_ttl_s(86'400);
    return grpc::Status::OK;
  }
  grpc::Status Step(grpc::ServerContext*, const v1::StepRequest*, v1::StepResponse*) override {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return is_over_; });
    return grpc::Status::OK;
  }
  void End() {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    ended_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_over_ = false;
};

TEST(VanishedPeersLong, AClientNoticesAServerBehindASilentCall) {
  SilentService service;
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 100);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  CuttingProxy proxy(port, kUncut, kUncut);
  ConnectOptions options;
  options.keepalive_s = 1;
  options.keepalive_timeout_s = 1;
  options.retries.max_tries = 1;
  const Client client = Client::Connect(proxy.Address(), options);
  Session session = client.CreateSession();
  session.Detach();
  auto step = std::async(std::launch::async, [&session] {
    v1::StepRequest request;
    request.set_all_cloths(true);
    request.set_steps(1);
    try {
      (void)session.Step(request);
      return ErrorCode::kInternal;
    } catch (const Error& error) {
      return error.code();
    }
  });
  EXPECT_EQ(step.wait_for(kManySigns), std::future_status::timeout);
  proxy.Unplug();
  EXPECT_EQ(step.wait_for(kNoticed), std::future_status::ready);
  service.End();
  server->Shutdown(std::chrono::system_clock::now());  // where it was not noticed
  EXPECT_EQ(step.get(), ErrorCode::kUnavailable);
}

TEST(VanishedPeersLong, AServerNoticesAClientBehindASilentStream) {
  ServerProcess server({"--backend=cpu", "--keepalive-ms=1000", "--keepalive-timeout-ms=1000",
                        "--reap-interval-ms=10"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto direct = server.NewStub();
  CuttingProxy proxy(PortOf(server.Address()), kUncut, kUncut);
  const auto stub = v1::SimulationService::NewStub(
      grpc::CreateChannel(proxy.Address(), grpc::InsecureChannelCredentials()));
  v1::CreateSessionRequest create;
  create.set_ttl_s(1);
  const std::string name = Call(*stub, &Stub::CreateSession, create).value.name();
  Create(*stub, HangingSheet(name, 4));
  grpc::ClientContext context;
  const auto stream = stub->StreamStates(&context);
  v1::StreamStatesRequest subscribe;
  subscribe.mutable_subscribe()->set_session(name);
  subscribe.mutable_subscribe()->set_all_cloths(true);
  ASSERT_TRUE(stream->Write(subscribe));
  const auto is_there = [&] {
    v1::GetSessionRequest request;
    request.set_name(name);
    return Call(*direct, &Stub::GetSession, request).status.ok();
  };
  std::this_thread::sleep_for(kManySigns);
  EXPECT_TRUE(is_there()) << "the stream keeps the session, whose lease is of 1 s";
  proxy.Unplug();
  const auto until = std::chrono::steady_clock::now() + kNoticed;
  while (is_there() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_FALSE(is_there());
  context.TryCancel();
}

}  // namespace
}  // namespace drape::test
