// What one client does to a server must not become the trouble of another.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/support/paths/paths.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::HasSubstr;

// A step of 50 * 10 000 sweeps: minutes on any backend, and legal.
v1::CreateClothsRequest HeavySheet(const std::string& session) {
  v1::CreateClothsRequest request = HangingSheet(session, 64);
  v1::StepSettings* settings = request.mutable_spec()->mutable_settings();
  settings->set_substeps(50);
  settings->set_max_iterations(10000);
  settings->set_tolerance(0);
  return request;
}

class LongSteps : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, LongSteps, testing::Values("cpu", "reference", "gl"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(LongSteps, BlockNobodyAndStopWhenCancelled) {
  InProcessServer server(GetParam());
  const auto stub = server.NewStub();
  const std::string greedy = NewSession(*stub), modest = NewSession(*stub);
  const Ids heavy = Create(*stub, HeavySheet(greedy));
  const Ids light = Create(*stub, HangingSheet(modest, 4));
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  v1::StepResponse response;
  grpc::Status status;
  const auto call = stub->AsyncStep(&context, StepsOf(greedy, heavy, 1), &queue);
  call->Finish(&response, &status, &response);
  for (int k = 0; k < 20; ++k) Step(*stub, StepsOf(modest, light, 1));
  EXPECT_EQ(Get(*stub, modest, light[0]).step(), 20u);
  EXPECT_EQ(Get(*stub, greedy, heavy[0]).step(), 0u) << "the step was too short for this test";
  context.TryCancel();
  // It stops at the next piece: the cloth itself can be changed and stepped again at once.
  v1::UpdateClothsRequest update;
  update.set_session(greedy);
  update.add_cloth_ids(heavy[0]);
  update.mutable_update_mask()->add_paths("settings");
  update.mutable_spec()->mutable_settings()->set_substeps(1);
  EXPECT_TRUE(Call(*stub, &Stub::UpdateCloths, update).status.ok());
  EXPECT_EQ(Step(*stub, StepsOf(greedy, heavy, 1)).steps(0), 1u);
  void* tag = nullptr;
  bool ok = false;
  ASSERT_TRUE(queue.Next(&tag, &ok));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
}

TEST(HostileClients, ALongStepDoesNotHoldUpTheEndOfTheServer) {
  ServerProcess server({"--drain-grace-ms=200", "--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids heavy = Create(*stub, HeavySheet(session));
  grpc::ClientContext context;
  const auto stream = stub->StepStream(&context);
  ASSERT_TRUE(stream->Write(StepsOf(session, heavy, 1)));
  std::this_thread::sleep_for(milliseconds(300));
  server.Signal(SIGTERM);
  v1::StepResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(ReasonOf(stream->Finish()), "DRAINING");
  EXPECT_EQ(server.WaitForExit(), 0);
}

// Calls whose answers nobody reads.
template <class Request, class Answer>
class UnreadCalls {
 public:
  using Call = std::unique_ptr<grpc::ClientAsyncResponseReader<Answer>>;
  using Method = Call (Stub::*)(grpc::ClientContext*, const Request&, grpc::CompletionQueue*);

  UnreadCalls(Stub& stub, Method method, const Request& request, int count) {
    for (int k = 0; k < count; ++k) {
      contexts_.push_back(std::make_unique<grpc::ClientContext>());
      calls_.push_back((stub.*method)(contexts_.back().get(), request, &queue_));
      calls_.back()->ReadInitialMetadata(this);  // sends the request; the answer is not asked for
    }
  }
  ~UnreadCalls() {
    for (const auto& context : contexts_) context->TryCancel();
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }

 private:
  grpc::CompletionQueue queue_;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts_;
  std::vector<Call> calls_;
};

// On a connection of its own, whose windows stay small.
std::unique_ptr<Stub> StubWithSmallWindows(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 65536);
  return v1::SimulationService::NewStub(
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
}

TEST(HostileClients, AnswersThatNobodyReadsAreCounted) {
  ServerProcess server({"--backend=cpu", "--max-unread-bytes-per-session=10000000"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string greedy = NewSession(*stub), modest = NewSession(*stub);
  const Ids large = Create(*stub, HangingSheet(greedy, 128));
  const Ids light = Create(*stub, HangingSheet(modest, 4));
  v1::StepRequest request = StepsOf(greedy, large, 1);
  request.mutable_view()->set_positions(true);
  request.mutable_view()->set_velocities(true);  // 393 kB
  {
    const auto own = StubWithSmallWindows(server.Address());
    const UnreadCalls<v1::StepRequest, v1::StepResponse> unread(*own, &Stub::AsyncStep, request,
                                                                60);
    const auto becomes_refused = [&](auto method, const auto& asked) {
      const auto until = steady_clock::now() + std::chrono::seconds(60);
      while (steady_clock::now() < until) {
        if (ReasonOf(Call(*stub, method, asked).status) == "TOO_MANY_UNREAD_BYTES") return true;
      }
      return false;
    };
    EXPECT_TRUE(becomes_refused(&Stub::Step, request));
    v1::ReadTopologyRequest topology;  // its answer is larger
    topology.set_session(greedy);
    topology.set_cloth_id(large[0]);
    EXPECT_TRUE(becomes_refused(&Stub::ReadTopology, topology));
    Step(*stub, StepsOf(modest, light, 1));
  }
  const auto until = steady_clock::now() + std::chrono::seconds(60);
  while (!Call(*stub, &Stub::Step, request).status.ok() && steady_clock::now() < until) {
  }
  EXPECT_TRUE(Call(*stub, &Stub::Step, request).status.ok());
}

// The repetition of a creation costs its client a few bytes, and is answered by all its ids.
TEST(HostileClients, IdsThatNobodyReadsAreCounted) {
  ServerProcess server({"--backend=cpu", "--max-unread-bytes-per-session=4000000"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  v1::CreateClothsRequest request = HangingSheet(NewSession(*stub), 2);
  request.set_count(60'000);
  request.set_request_id("once");
  const auto created = Call(*stub, &Stub::CreateCloths, request);
  ASSERT_TRUE(created.status.ok()) << created.status.error_message();
  const auto own = StubWithSmallWindows(server.Address());
  const UnreadCalls<v1::CreateClothsRequest, v1::CreateClothsResponse> unread(
      *own, &Stub::AsyncCreateCloths, request, 60);
  const auto until = steady_clock::now() + std::chrono::seconds(60);
  std::string reason;
  while (reason.empty() && steady_clock::now() < until) {
    reason = ReasonOf(Call(*stub, &Stub::CreateCloths, request).status);
  }
  EXPECT_EQ(reason, "TOO_MANY_UNREAD_BYTES");
}

TEST(HostileClients, PicturesCountAsUnreadFromTheirRequestOn) {
  api::RequestLimits limits;
  limits.max_unread_bytes_per_session = 4'000'000;
  InProcessServer server("cpu", {}, limits);
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  Create(*stub, HangingSheet(session, 4));
  v1::RenderRequest request;
  request.set_session(session);
  request.set_all_cloths(true);
  request.set_width_px(1024);
  request.set_height_px(1024);
  request.set_encoding(v1::RenderRequest::RGB8);  // 3.1 MB
  server.scheduler().HoldForTest();               // pictures wait for their states
  auto first = std::async(std::launch::async, [&] {
    grpc::Status status;
    do {
      status = Call(*stub, &Stub::Render, request).status;
    } while (ReasonOf(status) == "TOO_MANY_UNREAD_BYTES");
    return status;
  });
  grpc::Status second;
  do {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + milliseconds(200));
    v1::RenderResponse response;
    second = stub->Render(&context, request, &response);
  } while (second.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED);  // it came first
  EXPECT_EQ(ReasonOf(second), "TOO_MANY_UNREAD_BYTES");
  server.scheduler().ReleaseForTest();
  EXPECT_TRUE(first.get().ok());
}

TEST(HostileClients, ManyRequestsLaterAnIdIsStillKnown) {
  InProcessServer server("cpu");
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 4));
  std::vector<v1::StepRequest> requests;
  for (int k = 0; k < 300; ++k) {
    requests.push_back(StepsOf(session, ids, 1));
    requests.back().set_request_id("request-" + std::to_string(k));
    Step(*stub, requests.back());
  }
  EXPECT_EQ(Step(*stub, requests[0]).steps(0), 1u) << "the first answer again";
  EXPECT_EQ(Get(*stub, session, ids[0]).step(), 300u);
}

TEST(HostileClients, WhatIsCompressedIsRefusedAndNotInflated) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  v1::CreateClothsRequest request = HangingSheet(session, 4);
  request.set_request_id(std::string(32 << 20, 'x'));
  grpc::ClientContext context;
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::CreateClothsResponse response;
  const grpc::Status status = stub->CreateCloths(&context, request, &response);
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << "it was inflated";
  Create(*stub, HangingSheet(session, 4));
}

// 8 MB of empty parts, each of which would take a hundred bytes and more.
TEST(HostileClients, PartsWithoutContentTakeNoMemory) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 4));
  v1::CreateClothsRequest creation;
  v1::StepRequest step;
  for (int k = 0; k < 4'000'000; ++k) creation.add_overrides();
  for (int k = 0; k < 4'000'000; ++k) step.mutable_resets()->add_overrides();
  const uint64_t before_bytes = server.PeakMemory_bytes();
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::CreateCloths, creation).status), "REQUEST_TOO_LARGE");
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::Step, step).status), "REQUEST_TOO_LARGE");
  {
    grpc::ClientContext context;
    const auto stream = stub->StepStream(&context);
    stream->Write(step);
    v1::StepResponse response;
    EXPECT_FALSE(stream->Read(&response));
    EXPECT_EQ(ReasonOf(stream->Finish()), "REQUEST_TOO_LARGE");
  }
  // The bytes themselves, a few times.
  EXPECT_LT(server.PeakMemory_bytes() - before_bytes, uint64_t{60'000'000});
  Step(*stub, StepsOf(session, ids, 1));
}

// Whatever the method: none is left to the generated code, which parses whatever comes.
TEST(HostileClients, BytesThatAreNoRequestAreRefused) {
  InProcessServer server("cpu");
  grpc::GenericStub generic(server.server().InProcessChannel());
  const std::string text = "\xff\xff\xff";
  const grpc::Slice slice(text);
  const auto* const pool = google::protobuf::DescriptorPool::generated_pool();
  const auto* const service = pool->FindServiceByName(v1::SimulationService::service_full_name());
  for (int k = 0; k < service->method_count(); ++k) {
    const std::string name = service->method(k)->name();
    grpc::CompletionQueue queue;
    const auto is_done = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok);
    };
    grpc::ClientContext context;
    const auto call = generic.PrepareCall(&context, "/drape.v1.SimulationService/" + name, &queue);
    call->StartCall(nullptr);
    ASSERT_TRUE(is_done());
    call->WriteLast(grpc::ByteBuffer(&slice, 1), {}, nullptr);
    ASSERT_TRUE(is_done());
    grpc::Status status;
    call->Finish(&status, nullptr);
    ASSERT_TRUE(is_done());
    EXPECT_EQ(ReasonOf(status), "MALFORMED_REQUEST") << name;
  }
}

// A connection that says nothing.
class MuteConnection {
 public:
  explicit MuteConnection(const std::string& address) {
    const size_t colon = address.rfind(':');
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<uint16_t>(std::atoi(address.c_str() + colon + 1)));
    inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
    socket_ = socket(AF_INET, SOCK_STREAM, 0);
    const timeval patience{5, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    is_connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0;
  }
  MuteConnection(MuteConnection&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), is_connected_(other.is_connected_) {}
  ~MuteConnection() {
    if (socket_ >= 0) close(socket_);
  }
  bool is_connected() const { return is_connected_; }
  // Whether the other end ended it within 5 s.
  bool IsReset() const {
    char byte;
    return recv(socket_, &byte, 1, 0) < 0 && errno == ECONNRESET;
  }

 private:
  int socket_ = -1;
  bool is_connected_ = false;
};

TEST(HostileClients, TooManyConnectionsAreRefusedAndListeningGoesOn) {
  ServerProcess server({"--backend=cpu", "--max-connections=16"});
  ASSERT_TRUE(server.WaitUntilUp());
  const std::string session = NewSession(*server.NewStub());
  {
    std::vector<MuteConnection> many;
    for (int k = 0; k < 200; ++k) many.emplace_back(server.Address());
    const auto until = steady_clock::now() + std::chrono::seconds(30);
    while (server.Log().find("connection_refused") == std::string::npos &&
           steady_clock::now() < until) {
      std::this_thread::sleep_for(milliseconds(20));
    }
    EXPECT_THAT(server.Log(), HasSubstr("connection_refused reason=max_connections"));
  }
  const auto until = steady_clock::now() + std::chrono::seconds(60);
  bool is_in = false;
  while (!is_in && steady_clock::now() < until) {
    v1::GetSessionRequest request;
    request.set_name(session);
    is_in = Call(*server.NewStub(), &Stub::GetSession, request).status.ok();
  }
  EXPECT_TRUE(is_in) << "no new client gets in";
}

// An IPv4 address of this machine that is not loopback; empty: it has none.
std::string OwnAddress() {
  ifaddrs* all = nullptr;
  std::string found;
  if (getifaddrs(&all) != 0) return found;
  for (const ifaddrs* one = all; one != nullptr && found.empty(); one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if ((one->ifa_flags & IFF_LOOPBACK) != 0 || (one->ifa_flags & IFF_UP) == 0) continue;
    char text[INET_ADDRSTRLEN];
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text,
              sizeof(text));
    found = text;
  }
  freeifaddrs(all);
  return found;
}

TEST(HostileClients, OneAddressCannotTakeAllConnections) {
  const std::string own = OwnAddress();
  if (own.empty()) GTEST_SKIP() << "this machine has no address but loopback, which is exempt";
  ServerProcess server({"--backend=cpu", "--listen=0.0.0.0:0", "--insecure", "--max-connections=64",
                        "--max-connections-per-peer=4"});
  ASSERT_TRUE(server.WaitUntilUp());
  const std::string port = server.Address().substr(server.Address().rfind(':'));
  {
    std::vector<MuteConnection> many;
    for (int k = 0; k < 5; ++k) many.emplace_back(own + port);
    EXPECT_TRUE(many.back().IsReset());
    const std::string refused = "connection_refused reason=max_connections_per_peer";
    const auto until = steady_clock::now() + std::chrono::seconds(30);
    while (server.Log().find(refused) == std::string::npos && steady_clock::now() < until) {
      std::this_thread::sleep_for(milliseconds(20));
    }
    EXPECT_THAT(server.Log(), HasSubstr(refused));
    // Others get in: this machine.
    for (int k = 0; k < 8; ++k) NewSession(*server.NewStub());
  }
  const auto until = steady_clock::now() + std::chrono::seconds(60);
  grpc::Status status;
  do {
    const auto stub = v1::SimulationService::NewStub(
        grpc::CreateChannel(own + port, grpc::InsecureChannelCredentials()));
    status = Call(*stub, &Stub::CreateSession, v1::CreateSessionRequest()).status;
  } while (!status.ok() && steady_clock::now() < until);
  EXPECT_TRUE(status.ok()) << "the address does not get in again";
}

TEST(HostileClients, SignalsOfTerminalsAndLogsDoNotEndTheServer) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  for (const int signal : {SIGHUP, SIGUSR1, SIGPIPE}) server.Signal(signal);
  while (server.Log().find("statistics") == std::string::npos) std::this_thread::yield();
  const auto stub = server.NewStub();
  NewSession(*stub);
  EXPECT_TRUE(server.is_running());
  server.Signal(SIGTERM);
  EXPECT_EQ(server.WaitForExit(), 0);
}

// A reader that has ended, as `draped 2>&1 | head` has.
TEST(HostileClients, ALogThatNobodyReadsDoesNotEndTheServer) {
  const ScratchDir dir;
  const char* const chosen = std::getenv("DRAPE_TEST_SERVER");
  const std::string program = chosen != nullptr ? chosen : ProgramPath("draped").string();
  const std::string piped = dir / "piped";
  std::ofstream(piped) << "#!/bin/bash\nexec '" << program << "' \"$@\" 2> >(exec true)\n";
  std::filesystem::permissions(piped, std::filesystem::perms::owner_all);
  setenv("DRAPE_TEST_SERVER", piped.c_str(), 1);
  ServerProcess server({"--backend=cpu"});
  chosen != nullptr ? setenv("DRAPE_TEST_SERVER", program.c_str(), 1)
                    : unsetenv("DRAPE_TEST_SERVER");
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  for (int k = 0; k < 20; ++k) NewSession(*stub);  // a line each
  EXPECT_EQ(server.Log(), "") << "somebody reads it";
  server.Signal(SIGTERM);
  EXPECT_EQ(server.WaitForExit(), 0);
}

TEST(HostileClients, ALeaseDoesNotRunOutWhileTheServerIsStopped) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub, 2.5);
  server.Signal(SIGSTOP);
  std::this_thread::sleep_for(milliseconds(4000));
  server.Signal(SIGCONT);
  v1::GetSessionRequest request;
  request.set_name(session);
  const auto answer = Call(*stub, &Stub::GetSession, request);
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
}

TEST(HostileClients, NoSessionBeginsWhileTheServerShutsDown) {
  InProcessServer server("cpu");
  const auto stub = server.NewStub();
  server.scheduler().Drain(0);
  const auto answer = Call(*stub, &Stub::CreateSession, v1::CreateSessionRequest());
  EXPECT_EQ(ReasonOf(answer.status), "DRAINING");
}

}  // namespace
}  // namespace drape::test
