// Starting and stopping draped: addresses, devices, shaders, signals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <thread>
#include <vector>

#include "tests/support/paths/paths.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

class StopSignal : public testing::TestWithParam<int> {};

// Accepted work is finished, new work is refused, and the server ends with 0.
TEST_P(StopSignal, DrainsAndExitsWithZero) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 32));
  // Some tenths of a second: far longer than it takes to send a signal.
  constexpr uint32_t kSteps = 3000;
  grpc::ClientContext context;
  const auto stream = stub->StepStream(&context);
  ASSERT_TRUE(stream->Write(StepsOf(session, ids, kSteps)));
  while (Get(*stub, session, ids[0]).step() == 0) std::this_thread::yield();
  server.Signal(GetParam());
  v1::StepResponse response;
  ASSERT_TRUE(stream->Read(&response)) << "the request under way was not finished";
  EXPECT_EQ(response.steps(0), kSteps);
  EXPECT_EQ(server.WaitForExit(), 0) << server.Log();
  EXPECT_THAT(server.Log(), ContainsRegex("draining signal=.*stopped"));
}
INSTANTIATE_TEST_SUITE_P(All, StopSignal, testing::Values(SIGTERM, SIGINT));

TEST(Lifecycle, DrainingRefusesNewWork) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 32, 2));
  grpc::ClientContext context;
  const auto stream = stub->StepStream(&context);
  ASSERT_TRUE(stream->Write(StepsOf(session, {ids[0]}, 100000)));
  while (Get(*stub, session, ids[0]).step() == 0) std::this_thread::yield();
  server.Signal(SIGTERM);
  while (server.Log().find("draining") == std::string::npos) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const auto refused = Call(*stub, &Stub::Step, StepsOf(session, {ids[1]}, 1));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(refused.status), "DRAINING") << refused.status.error_message();
  context.TryCancel();  // otherwise the server gives the long request its grace
  EXPECT_EQ(server.WaitForExit(), 0);
}

TEST(Lifecycle, WorkThatOutlivesTheGraceEndsWithUnavailable) {
  ServerProcess server({"--drain-grace-ms=100"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 32));
  grpc::ClientContext context;
  const auto stream = BeginEndlessSteps(*stub, context, session, ids);
  server.Signal(SIGTERM);
  v1::StepResponse response;
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_EQ(ReasonOf(status), "DRAINING");
  EXPECT_THAT(status.error_message(), HasSubstr("complete steps stay"));
  EXPECT_EQ(server.WaitForExit(), 0);
}

// What builders make of a million particles that touch each other takes more than the patience, and
// of three times as many far more.
TEST(Lifecycle, BuildsUnderWayAreGivenUp) {
  ServerProcess server({"--drain-grace-ms=100"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  v1::CreateClothsRequest request = HangingSheet(NewSession(*stub), 1024);
  request.mutable_spec()->mutable_self_collision();
  std::vector<std::future<grpc::Status>> created;
  for (int k = 0; k < 3; ++k) {
    created.push_back(std::async(std::launch::async,
                                 [&] { return Call(*stub, &Stub::CreateCloths, request).status; }));
  }
  std::this_thread::sleep_for(std::chrono::seconds(3));
  server.Signal(SIGTERM);
  size_t given_up = 0;
  for (auto& status : created) given_up += ReasonOf(status.get()) == "DRAINING";
  EXPECT_GT(given_up, 0u);
  EXPECT_EQ(server.WaitForExit(), 0) << server.Log();
}

TEST(Lifecycle, ASecondSignalEndsTheServerAtOnce) {
  ServerProcess server({"--drain-grace-ms=3600000"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 32));
  grpc::ClientContext context;
  const auto stream = BeginEndlessSteps(*stub, context, session, ids);
  server.Signal(SIGTERM);
  while (server.Log().find("draining") == std::string::npos) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));  // sooner it is the same again
  server.Signal(SIGTERM);
  EXPECT_EQ(server.WaitForExit(), 1);
  EXPECT_THAT(server.Log(), HasSubstr("STOPPED_TWICE"));
  context.TryCancel();
}

TEST(Lifecycle, AStopTakesNothingFromALease) {
  ServerProcess server({"--reap-interval-ms=10"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub, 1);
  for (int k = 0; k < 2; ++k) {
    server.Signal(SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    server.Signal(SIGCONT);
    v1::RenewSessionRequest renewal;
    renewal.set_name(session);
    EXPECT_EQ(ReasonOf(Call(*stub, &Stub::RenewSession, renewal).status), "");
  }
}

TEST(Lifecycle, ASecondServerOnTheSamePortFailsClearly) {
  ServerProcess first;
  ASSERT_TRUE(first.WaitUntilUp());
  ServerProcess second({"--listen=" + first.Address()});
  EXPECT_EQ(second.WaitForExit(), 1);
  EXPECT_THAT(second.Log(), HasSubstr("LISTEN_FAILED"));
  EXPECT_THAT(second.Log(), HasSubstr("the port is in use"));
  const auto stub = first.NewStub();
  EXPECT_NE(NewSession(*stub), "");
}

TEST(Lifecycle, AnAddressForOthersNeedsTlsOrTheWordInsecure) {
  ServerProcess refused({"--listen=0.0.0.0:0"});
  EXPECT_EQ(refused.WaitForExit(), 1);
  EXPECT_THAT(refused.Log(), HasSubstr("--insecure"));
  ServerProcess accepted({"--listen=0.0.0.0:0", "--insecure"});
  EXPECT_TRUE(accepted.WaitUntilUp());
}

TEST(Lifecycle, EmptyTlsFilesAreNoReasonToServeInTheClear) {
  ServerProcess server({"--tls-cert=/dev/null", "--tls-key=/dev/null"});
  EXPECT_EQ(server.WaitForExit(), 1);
  EXPECT_THAT(server.Log(), HasSubstr("TLS_FILE_FAILED"));
}

TEST(Lifecycle, NoEglDeviceIsSaidClearly) {
  ServerProcess server({"--backend=gl"}, {{"__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null"}});
  EXPECT_EQ(server.WaitForExit(), 1);
  EXPECT_THAT(server.Log(), HasSubstr("NO_EGL_DEVICE"));
}

TEST(Lifecycle, AutoFallsBackToTheProcessorWithoutAnEglDevice) {
  ServerProcess server({"--backend=auto"}, {{"__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null"}});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  EXPECT_EQ(Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value.backend(), "cpu");
}

// The log names the file and the line of the error.
TEST(Lifecycle, AShaderThatDoesNotCompileIsNamedWithFileAndLine) {
  namespace fs = std::filesystem;
  const ScratchDir scratch;
  const fs::path shaders = scratch / "shaders";
  fs::copy(SourcePath("shaders"), shaders, fs::copy_options::recursive);
  const fs::path spoiled = shaders / "lib" / "vector.glsl";
  std::ifstream file(spoiled);
  const auto last_line = std::count(std::istreambuf_iterator<char>(file), {}, '\n') + 1;
  std::ofstream(spoiled, std::ios::app) << "this is no shader\n";
  ServerProcess server({"--backend=gl", "--shader-dir=" + shaders.string()});
  EXPECT_EQ(server.WaitForExit(), 1);
  EXPECT_THAT(server.Log(), HasSubstr("SHADER_COMPILE_FAILED"));
  // The driver's own words follow.
  EXPECT_THAT(server.Log(),
              ::testing::ContainsRegex("lib/vector[.]glsl:" + std::to_string(last_line) + "[: ]"));
}

TEST(Lifecycle, UsageErrorsExitWithTwo) {
  for (const char* flag :
       {"--nonsense", "--backend=abacus", "--max-sessions=0", "--session-ttl-s=0",
        "--config=/nonexistent.json", "--tls-cert=/nonexistent.pem"}) {
    ServerProcess server({flag});
    EXPECT_EQ(server.WaitForExit(), 2) << flag;
    EXPECT_THAT(server.Log(), testing::Not(testing::IsEmpty())) << flag;
  }
}

TEST(Lifecycle, ReadsAConfigFileInBothFormats) {
  const ScratchDir scratch;
  const std::string json = scratch / "config.json";
  const std::string lines = scratch / "config.ini";
  std::ofstream(json) << R"({"max-sessions": 1, "backend": "reference"})";
  std::ofstream(lines) << "max-sessions=1\nbackend=reference\n";
  for (const std::string& path : {json, lines}) {
    // The command line wins: ServerProcess asks for the cpu backend.
    ServerProcess server({"--config=" + path});
    ASSERT_TRUE(server.WaitUntilUp());
    const auto stub = server.NewStub();
    const auto info = Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value;
    EXPECT_EQ(info.backend(), "cpu") << path;
    EXPECT_EQ(info.limits().max_sessions(), 1u) << path;
    NewSession(*stub);
    const auto full = Call(*stub, &Stub::CreateSession, v1::CreateSessionRequest());
    EXPECT_EQ(full.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(ReasonOf(full.status), "TOO_MANY_SESSIONS");
  }
  const std::string unknown = scratch / "unknown.json";
  std::ofstream(unknown) << R"({"max-session": 1})";
  ServerProcess refused({"--config=" + unknown});
  EXPECT_EQ(refused.WaitForExit(), 2);
  EXPECT_THAT(refused.Log(), HasSubstr("max-session"));
}

}  // namespace
}  // namespace drape::test
