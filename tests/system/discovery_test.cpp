// Public information about a server: health, reflection, server info, sessions.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

// One request, one answer, as bytes: these services have no stubs among our dependencies.
// The caller says what it expects of the status.
std::string CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                    const std::string& request, grpc::StatusCode expected = grpc::OK) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto step = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok));
    return ok;
  };
  const auto stream = stub.PrepareCall(&context, method, &queue);
  stream->StartCall(nullptr);
  EXPECT_TRUE(step());
  const grpc::Slice slice(request);
  stream->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  const bool was_written = step();  // a refusal may come before the request is written
  EXPECT_TRUE(was_written || expected != grpc::OK);
  grpc::ByteBuffer answer;
  stream->Read(&answer, nullptr);
  const bool has_answer = step();
  grpc::Status status;
  stream->Finish(&status, nullptr);
  step();
  EXPECT_EQ(status.error_code(), expected) << method << ": " << status.error_message();
  EXPECT_EQ(has_answer, expected == grpc::OK);
  grpc::Slice bytes;
  if (!has_answer || !answer.DumpToSingleSlice(&bytes).ok()) return "";
  return {reinterpret_cast<const char*>(bytes.begin()), bytes.size()};
}

// grpc.health.v1.HealthCheckRequest{service = 1}, HealthCheckResponse{status = 1}.
std::string Health(const std::shared_ptr<grpc::Channel>& channel, const std::string& service) {
  const std::string request =
      service.empty() ? "" : "\x0A" + std::string(1, static_cast<char>(service.size())) + service;
  return CallRaw(channel, "/grpc.health.v1.Health/Check", request);
}
const std::string kServing("\x08\x01");
const std::string kNotServing("\x08\x02");

TEST(Discovery, HealthFollowsServing) {
  InProcessServer server("cpu");
  const auto channel = server.server().InProcessChannel();
  for (const char* service : {"", "drape.v1.SimulationService"}) {
    EXPECT_EQ(Health(channel, service), kServing);
  }
  server.server().SetServing(false);
  for (const char* service : {"", "drape.v1.SimulationService"}) {
    EXPECT_EQ(Health(channel, service), kNotServing);
  }
}

TEST(Discovery, ReflectionListsTheService) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  // ServerReflectionRequest{list_services (7) = "*"}.
  const std::string answer =
      CallRaw(server.NewChannel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
              "\x3A\x01*");
  EXPECT_THAT(answer, testing::HasSubstr("drape.v1.SimulationService"));
  EXPECT_THAT(answer, testing::HasSubstr("grpc.health.v1.Health"));
  // ServerReflectionRequest{file_containing_symbol (4)}.
  for (const auto& [service, method] : {std::pair("drape.v1.SimulationService", "StepStream"),
                                        std::pair("drape.v1.AdminService", "ListTenants")}) {
    const std::string name = service;
    const std::string described = CallRaw(
        server.NewChannel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
        "\x22" + std::string(1, static_cast<char>(name.size())) + name);
    EXPECT_THAT(described, testing::HasSubstr(method));
  }
}

TEST(Discovery, OperatorsAloneSeeAllConnections) {
  const std::string path = testing::TempDir() + "drape_discovery_" + std::to_string(getpid());
  const std::string admin = "unix:" + path;
  ServerProcess server({"--admin-listen=" + admin});
  ASSERT_TRUE(server.WaitUntilUp());
  const std::string method = "/grpc.channelz.v1.Channelz/GetServers";
  const auto of_clients = server.NewChannel();
  const auto of_operators = grpc::CreateChannel(admin, grpc::InsecureChannelCredentials());
  EXPECT_THAT(CallRaw(of_operators, method, ""), testing::HasSubstr("127.0.0.1:"));
  CallRaw(of_clients, method, "", grpc::UNIMPLEMENTED);
  EXPECT_EQ(Health(of_operators, "drape.v1.AdminService"), kServing);
  EXPECT_EQ(Health(of_clients, "drape.v1.SimulationService"), kServing);
}

class Info : public testing::TestWithParam<std::string> {};

TEST_P(Info, TellsWhatTheServerIs) {
  ServerProcess server({"--backend=" + GetParam()});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  Create(*stub, HangingSheet(session, 8, 3));
  const auto info = Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value;
  EXPECT_THAT(info.version(), testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_NE(info.incarnation(), "");
  EXPECT_EQ(info.backend(), GetParam());
  EXPECT_NE(info.device(), "");
  EXPECT_EQ(info.precision(), GetParam() == "reference" ? "float64" : "float32");
  EXPECT_EQ(info.session_count(), 1u);
  EXPECT_EQ(info.cloth_count(), 3u);
  EXPECT_EQ(info.particle_count(), 192u);
  EXPECT_GT(info.uptime_s(), 0);
  const auto* limits = info.limits().GetDescriptor();
  for (int k = 0; k < limits->field_count(); ++k) {
    // Without tenants: 0.
    if (limits->field(k)->name() == "max_particle_substeps_per_s") continue;
    if (limits->field(k)->name() == "max_builder_s_per_s") continue;
    EXPECT_TRUE(info.limits().GetReflection()->HasField(info.limits(), limits->field(k)))
        << limits->field(k)->name() << " is not published";
  }
}
INSTANTIATE_TEST_SUITE_P(All, Info, testing::ValuesIn(BackendNames()),
                         [](const auto& backend) { return backend.param; });

TEST(Discovery, SessionListsDoNotGiveAccess) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const auto list = Call(*stub, &Stub::ListSessions, v1::ListSessionsRequest()).value;
  ASSERT_EQ(list.sessions_size(), 1);
  const std::string& shown = list.sessions(0).name();
  EXPECT_NE(shown, session);
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::Step, StepsOf(shown, {}, 1)).status), "SESSION_NOT_FOUND");
  EXPECT_EQ(server.Log().find(session), std::string::npos) << "nor does the log";
}

TEST(Discovery, DeletedAndRenewedSessions) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  v1::RenewSessionRequest renew;
  renew.set_name(NewSession(*stub, 100));
  const auto renewed = Call(*stub, &Stub::RenewSession, renew);
  EXPECT_EQ(renewed.value.ttl_s(), 100);
  EXPECT_GT(renewed.value.remaining_s(), 90);
  Create(*stub, HangingSheet(renew.name()));
  v1::DeleteSessionRequest remove;
  remove.set_name(renew.name());
  EXPECT_TRUE(Call(*stub, &Stub::DeleteSession, remove).status.ok());
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::RenewSession, renew).status), "SESSION_NOT_FOUND");
  const auto info = Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value;
  EXPECT_EQ(info.session_count() + info.cloth_count(), 0u);
}

}  // namespace
}  // namespace drape::test
