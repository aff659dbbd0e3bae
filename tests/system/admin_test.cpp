// What operators see and do, and that nobody else does.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "drape/v1/admin_service.grpc.pb.h"
#include "server/api/sha256.h"
#include "server/core/text.h"
#include "tests/system/calls.h"
#include "tests/system/metrics.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;
using AdminStub = v1::AdminService::Stub;

class AdminTest : public testing::Test {
 protected:
  // The token of a tenant, or of operators, is its name.
  void Start(std::vector<std::string> flags = {}, bool has_tokens = true) {
    if (has_tokens) {
      std::ofstream file(dir_ / "tokens");
      file << "one " << HexOf(api::Sha256Of("one"))
           << " particle_substeps_per_s=1e12 builder_s_per_s=3\n"
           << "two " << HexOf(api::Sha256Of("two")) << "\n"
           << "@operator " << HexOf(api::Sha256Of("operator")) << "\n";
      file.close();
      flags.push_back("--token-file=" + (dir_ / "tokens"));
    }
    flags.push_back("--admin-listen=unix:" + (dir_ / "admin"));
    server_ = std::make_unique<ServerProcess>(flags);
    ASSERT_TRUE(server_->WaitUntilUp());
    stub_ = server_->NewStub();
    by_token_ = v1::AdminService::NewStub(server_->NewChannel());
    admin_ = v1::AdminService::NewStub(
        grpc::CreateChannel("unix:" + (dir_ / "admin"), grpc::InsecureChannelCredentials()));
  }

  // Of the port for operators, unless there is a token.
  template <class Request, class Response>
  Answer<Response> Ask(grpc::Status (AdminStub::*method)(grpc::ClientContext*, const Request&,
                                                         Response*),
                       const Request& request, const std::string& token = "") {
    return token.empty() ? Call(*admin_, method, request)
                         : Call(*by_token_, method, request, "Bearer " + token);
  }
  template <class Request, class Response>
  Answer<Response> As(const std::string& token,
                      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request) {
    return Call(*stub_, method, request, token.empty() ? token : "Bearer " + token);
  }
  std::string SessionOf(const std::string& token) {
    const auto answer = As(token, &Stub::CreateSession, v1::CreateSessionRequest());
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    return answer.value.name();
  }

  ScratchDir dir_;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<Stub> stub_;
  std::unique_ptr<AdminStub> by_token_, admin_;
};

// A call of any method with an empty request.
grpc::Status CallByName(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                        const std::string& token) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  const grpc::ByteBuffer request(nullptr, 0);
  grpc::ByteBuffer response;
  std::promise<grpc::Status> done;
  stub.UnaryCall(&context, method, grpc::StubOptions(), &request, &response,
                 [&done](grpc::Status status) { done.set_value(std::move(status)); });
  return done.get_future().get();
}

TEST_F(AdminTest, EveryMethodRefusesTenantsAndStrangers) {
  Start();
  const std::string session = SessionOf("two");
  const auto channel = server_->NewChannel();
  const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
      "drape.v1.AdminService");
  ASSERT_NE(service, nullptr);
  ASSERT_GE(service->method_count(), 6);
  for (int k = 0; k < service->method_count(); ++k) {
    const std::string method = "/drape.v1.AdminService/" + service->method(k)->name();
    for (const char* token : {"one", "two"}) {
      const grpc::Status status = CallByName(channel, method, token);
      EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << method;
      EXPECT_EQ(ReasonOf(status), "ADMIN_ONLY");
    }
    for (const char* token : {"", "nobody", "@operator"}) {
      const grpc::Status status = CallByName(channel, method, token);
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << method;
      EXPECT_EQ(ReasonOf(status), "INVALID_TOKEN");
    }
  }
  EXPECT_TRUE(server_->is_running());
  EXPECT_TRUE(As("two", &Stub::Step, StepsOf(session, {}, 1)).status.ok());
  // The operator's token is for this service alone, and this port for no other.
  EXPECT_TRUE(Ask(&AdminStub::ListTenants, v1::ListTenantsRequest(), "operator").status.ok());
  const grpc::Status refused =
      As("operator", &Stub::CreateSession, v1::CreateSessionRequest()).status;
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(refused.error_message(),
              testing::HasSubstr("@operator is for drape.v1.AdminService alone"));
  const auto own =
      grpc::CreateChannel("unix:" + (dir_ / "admin"), grpc::InsecureChannelCredentials());
  EXPECT_EQ(CallByName(own, "/drape.v1.SimulationService/CreateSession", "one").error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(AdminTest, WithoutTokensThePortForOperatorsIsTheOnlyWay) {
  Start({}, false);
  const auto channel = server_->NewChannel();
  EXPECT_EQ(CallByName(channel, "/drape.v1.AdminService/ListTenants", "").error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  struct stat of_socket {};
  ASSERT_EQ(stat((dir_ / "admin").c_str(), &of_socket), 0);
  EXPECT_EQ(of_socket.st_mode & 077, 0u) << "others of this machine reach it";
  const std::string session = NewSession(*stub_);
  Create(*stub_, HangingSheet(session, 8, 2));
  Step(*stub_, StepsOf(session, {}, 3));
  const auto tenants = Ask(&AdminStub::ListTenants, v1::ListTenantsRequest());
  ASSERT_EQ(tenants.value.tenants_size(), 1);
  EXPECT_EQ(tenants.value.tenants(0).name(), "");
  EXPECT_EQ(tenants.value.tenants(0).cloth_count(), 2u);
  EXPECT_EQ(tenants.value.tenants(0).particle_substeps(), 2u * 64 * 4 * 3);
}

TEST_F(AdminTest, ListsWhatTenantsHold) {
  Start();
  const std::string a = SessionOf("one"), b = SessionOf("one");
  const auto created = As("one", &Stub::CreateCloths, HangingSheet(a, 8, 3));
  ASSERT_TRUE(created.status.ok());
  v1::StepRequest step = StepsOf(a, {}, 5);
  step.set_request_id("kept");
  ASSERT_TRUE(As("one", &Stub::Step, step).status.ok());
  v1::SaveStatesRequest save;
  save.set_session(a);
  save.set_all_cloths(true);
  save.set_name("start");
  ASSERT_TRUE(As("one", &Stub::SaveStates, save).status.ok());

  const auto tenants = Ask(&AdminStub::ListTenants, v1::ListTenantsRequest());
  ASSERT_EQ(tenants.value.tenants_size(), 2) << tenants.status.error_message();
  const v1::TenantUse& one = tenants.value.tenants(0);
  EXPECT_EQ(one.name(), "one");
  EXPECT_EQ(one.session_count(), 2u);
  EXPECT_EQ(one.cloth_count(), 3u);
  EXPECT_EQ(one.particle_count(), 3u * 64);
  EXPECT_GE(one.saved_bytes(), 3u * 64 * 24) << "positions and velocities";
  EXPECT_GT(one.remembered_bytes(), 0u);
  EXPECT_EQ(one.queued_requests(), 0u);
  EXPECT_EQ(one.particle_substeps(), 3u * 64 * 4 * 5);
  EXPECT_GT(one.particle_substeps_per_s(), 0);
  EXPECT_EQ(one.max_particle_substeps_per_s(), 1e12);
  EXPECT_GT(one.builder_s(), 0);
  EXPECT_GT(one.builder_s_per_s(), 0);
  EXPECT_EQ(one.max_builder_s_per_s(), 3);
  EXPECT_EQ(one.builder_wait_s(), 0);
  const v1::TenantUse& two = tenants.value.tenants(1);
  EXPECT_EQ(two.name(), "two") << "a tenant that has nothing";
  EXPECT_EQ(two.session_count(), 0u);
  EXPECT_EQ(two.max_particle_substeps_per_s(), 0);
  EXPECT_EQ(two.max_builder_s_per_s(), 1) << "the default";

  SessionOf("two");
  v1::ListAllSessionsRequest list;
  list.set_page_size(2);
  const auto first = Ask(&AdminStub::ListAllSessions, list);
  ASSERT_EQ(first.value.sessions_size(), 2);
  EXPECT_EQ(first.value.sessions(0).tenant(), "one");
  EXPECT_EQ(first.value.sessions(0).cloth_count(), 3u);
  list.set_page_token(first.value.next_page_token());
  const auto second = Ask(&AdminStub::ListAllSessions, list);
  ASSERT_EQ(second.value.sessions_size(), 1);
  EXPECT_EQ(second.value.sessions(0).tenant(), "two");
  // No name that would give access.
  for (const auto& page : {first, second}) {
    EXPECT_EQ(page.value.SerializeAsString().find(a), std::string::npos);
    EXPECT_EQ(page.value.SerializeAsString().find(b), std::string::npos);
  }
}

TEST_F(AdminTest, DropsASessionOfAnyTenant) {
  Start();
  const std::string greedy = SessionOf("one"), modest = SessionOf("two");
  ASSERT_TRUE(As("one", &Stub::CreateCloths, HangingSheet(greedy)).status.ok());
  ASSERT_TRUE(As("two", &Stub::CreateCloths, HangingSheet(modest)).status.ok());
  const auto list = Ask(&AdminStub::ListAllSessions, v1::ListAllSessionsRequest());
  v1::DropSessionRequest drop;
  drop.set_number(list.value.sessions(0).number());
  EXPECT_TRUE(Ask(&AdminStub::DropSession, drop).status.ok());
  EXPECT_THAT(server_->Log(),
              testing::ContainsRegex("session_dropped name=.* tenant=one by=operator"));
  EXPECT_EQ(ReasonOf(As("one", &Stub::Step, StepsOf(greedy, {}, 1)).status), "SESSION_NOT_FOUND");
  EXPECT_TRUE(As("two", &Stub::Step, StepsOf(modest, {}, 1)).status.ok());
  EXPECT_EQ(ReasonOf(Ask(&AdminStub::DropSession, drop).status), "SESSION_NOT_FOUND");
}

TEST_F(AdminTest, IsReachedWhenOthersHaveAllConnections) {
  Start({"--max-connections=4"});
  const auto soon = [] { return std::chrono::system_clock::now() + std::chrono::seconds(1); };
  std::vector<std::shared_ptr<grpc::Channel>> channels;
  do {
    channels.push_back(server_->NewChannel());
    ASSERT_LT(channels.size(), 200u) << "nothing is refused";
  } while (channels.back()->WaitForConnected(soon()));
  EXPECT_TRUE(Ask(&AdminStub::ListTenants, v1::ListTenantsRequest()).status.ok());
  EXPECT_FALSE(server_->NewChannel()->WaitForConnected(soon()));
}

TEST_F(AdminTest, DrainsTheServer) {
  Start();
  EXPECT_TRUE(Ask(&AdminStub::Drain, v1::DrainRequest()).status.ok());
  // Neither another request nor a supervisor ends it at once.
  Ask(&AdminStub::Drain, v1::DrainRequest());
  server_->Signal(SIGTERM);
  EXPECT_EQ(server_->WaitForExit(), 0);
  EXPECT_THAT(server_->Log(), HasSubstr("drain_requested"));
  EXPECT_THAT(server_->Log(), HasSubstr("stopped"));
}

TEST_F(AdminTest, WritesCheckpointsNow) {
  const std::string folder = dir_ / "checkpoints";
  Start({"--checkpoint-dir=" + folder, "--checkpoint-interval-s=86400"});
  const std::string session = SessionOf("one");
  ASSERT_TRUE(As("one", &Stub::CreateCloths, HangingSheet(session)).status.ok());
  ASSERT_TRUE(As("one", &Stub::Step, StepsOf(session, {}, 7)).status.ok());
  const auto written = Ask(&AdminStub::WriteCheckpoints, v1::WriteCheckpointsRequest());
  EXPECT_TRUE(written.status.ok()) << written.status.error_message();
  EXPECT_EQ(written.value.session_count(), 1u);
  std::filesystem::rename(folder, folder + "-kept");
  ASSERT_TRUE(As("one", &Stub::Step, StepsOf(session, {}, 1)).status.ok());
  EXPECT_EQ(ReasonOf(Ask(&AdminStub::WriteCheckpoints, v1::WriteCheckpointsRequest()).status),
            "FILE_FAILED");
  std::filesystem::rename(folder + "-kept", folder);
  server_->Signal(SIGKILL);
  server_->WaitForExit();
  Start({"--checkpoint-dir=" + folder});
  const auto cloths = As("one", &Stub::Step, StepsOf(session, {}, 1));
  ASSERT_TRUE(cloths.status.ok()) << cloths.status.error_message();
  EXPECT_EQ(cloths.value.steps(0), 8u);
}

TEST_F(AdminTest, WithoutAFolderThereAreNoCheckpoints) {
  Start();
  EXPECT_EQ(ReasonOf(Ask(&AdminStub::WriteCheckpoints, v1::WriteCheckpointsRequest()).status),
            "NO_CHECKPOINTS");
}

// Everything that is counted happens while the recording is under way.
TEST_F(AdminTest, RecordsATraceWhoseBatchesAreThoseOfTheMetrics) {
  Start({"--metrics-listen=127.0.0.1:0", "--max-queue-delay-us=0"});
  const std::string session = SessionOf("one");
  ASSERT_TRUE(As("one", &Stub::CreateCloths, HangingSheet(session, 8, 3)).status.ok());
  const auto log_has = [&](const char* event) {
    return server_->Log().find(event) != std::string::npos;
  };
  v1::RecordTraceRequest request;
  request.set_duration_s(2);
  auto call = std::async(std::launch::async, [&] { return Ask(&AdminStub::RecordTrace, request); });
  while (!log_has("trace_started")) std::this_thread::yield();
  EXPECT_EQ(ReasonOf(Ask(&AdminStub::RecordTrace, request).status), "TRACE_IN_PROGRESS");
  const std::string before = MetricsOf(*server_);
  for (int k = 0; k < 20; ++k) {
    v1::StepRequest step = StepsOf(session, {}, 1 + k % 3);
    step.mutable_view()->set_positions(true);
    ASSERT_TRUE(As("one", &Stub::Step, step).status.ok());
  }
  ASSERT_TRUE(As("one", &Stub::CreateCloths, HangingSheet(session)).status.ok());
  const std::string after = MetricsOf(*server_);
  ASSERT_FALSE(log_has("trace_ended")) << "the machine is too slow for this recording";
  const auto recorded = call.get();
  ASSERT_TRUE(recorded.status.ok()) << recorded.status.error_message();
  EXPECT_EQ(recorded.value.events_left_out(), 0u);

  const Json trace = Json::parse(recorded.value.json(), nullptr, /*allow_exceptions=*/false);
  ASSERT_TRUE(trace.is_object());
  std::map<std::string, int> counts;
  std::map<int, std::string> threads;
  int64_t dispatches = 0, cloths = 0;
  std::set<std::string> batches_on;
  for (const Json& event : trace["traceEvents"]) {
    if (event["name"] == "thread_name") threads[event["tid"]] = event["args"]["name"];
  }
  for (const Json& event : trace["traceEvents"]) {
    if (event["ph"] == "M" || event["ph"] == "e") continue;
    ++counts[event["name"]];
    if (event["name"] == "batch") batches_on.insert(threads[event["tid"]]);
    if (event["name"] != "step") continue;
    dispatches += event["args"]["dispatches"].get<int64_t>();
    cloths += event["args"]["cloths"].get<int64_t>();
  }
  const auto difference = [&](const char* metric) {
    return MetricIn(after, metric) - MetricIn(before, metric);
  };
  EXPECT_EQ(counts["batch"], difference("drape_batches_total"));
  EXPECT_EQ(counts["batch"], 20 + 19) << "1 + k % 3 steps each";
  EXPECT_EQ(dispatches, difference("drape_dispatches_total"));
  EXPECT_EQ(cloths, difference("drape_cloth_steps_total"));
  EXPECT_EQ(counts["queue"], 20);
  EXPECT_EQ(counts["encode_answer"], 20);
  EXPECT_EQ(counts["encode_states"], 20);
  EXPECT_EQ(counts["build"], 1);
  EXPECT_EQ(counts["build_queue"], 1);
  EXPECT_EQ(batches_on, std::set<std::string>{"device"});

  request.set_duration_s(61);
  EXPECT_EQ(FieldsOf(Ask(&AdminStub::RecordTrace, request).status),
            std::vector<std::string>{"duration_s"});
}

TEST_F(AdminTest, ADrainDoesNotWaitForATrace) {
  Start();
  v1::RecordTraceRequest request;
  request.set_duration_s(60);
  auto call = std::async(std::launch::async, [&] { return Ask(&AdminStub::RecordTrace, request); });
  while (server_->Log().find("trace_started") == std::string::npos) std::this_thread::yield();
  const auto begin = std::chrono::steady_clock::now();
  server_->Signal(SIGTERM);
  EXPECT_EQ(server_->WaitForExit(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
  call.get();
}

TEST_F(AdminTest, SetsTheLogLevel) {
  Start();
  v1::SetLogLevelRequest request;
  request.set_level("error");
  EXPECT_EQ(Ask(&AdminStub::SetLogLevel, request).value.former_level(), "info");
  SessionOf("one");
  request.set_level("debug");
  EXPECT_EQ(Ask(&AdminStub::SetLogLevel, request).value.former_level(), "error");
  EXPECT_EQ(server_->Log().find("session_created"), std::string::npos);
  SessionOf("one");
  EXPECT_THAT(server_->Log(), HasSubstr("session_created"));
  request.set_level("loud");
  const grpc::Status refused = Ask(&AdminStub::SetLogLevel, request).status;
  EXPECT_EQ(FieldsOf(refused), std::vector<std::string>{"level"});
}

}  // namespace
}  // namespace drape::test
