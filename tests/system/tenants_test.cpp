// A server with tokens: who may call, and what a tenant sees of others: nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/metrics.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::HasSubstr;

class Tenants : public testing::Test {
 protected:
  // The tokens are "one-token" and "two-token".
  void Start(std::vector<std::string> flags = {}) {
    WriteTokens("one " + Hash("one-token") + "\ntwo " + Hash("two-token") + "\n");
    flags.push_back("--backend=cpu");
    flags.push_back("--token-file=" + (dir_ / "tokens"));
    server_ = std::make_unique<ServerProcess>(flags);
    ASSERT_TRUE(server_->WaitUntilUp());
    stub_ = server_->NewStub();
  }

  static std::string Output(const std::string& command) {
    FILE* const pipe = popen(command.c_str(), "r");
    std::string output;
    for (int c; (c = std::fgetc(pipe)) != EOF;) output += static_cast<char>(c);
    pclose(pipe);
    return output;
  }

  static std::string Hash(const std::string& token) {
    return Output("printf %s '" + token + "' | sha256sum").substr(0, 64);
  }

  void WriteTokens(const std::string& text) { std::ofstream(dir_ / "tokens") << text; }

  template <class Request, class Response>
  Answer<Response> As(const std::string& token,
                      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request) {
    return Call(*stub_, method, request, token);
  }

  std::string SessionOf(const std::string& token) {
    const auto answer = As(token, &Stub::CreateSession, v1::CreateSessionRequest());
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    return answer.value.name();
  }

  ScratchDir dir_;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<Stub> stub_;
};

const std::string kOne = "Bearer one-token", kTwo = "Bearer two-token";

TEST_F(Tenants, WithoutAValidTokenNothingIsAnswered) {
  Start();
  const std::string session = SessionOf(kOne);
  for (const std::string& token :
       {std::string(), std::string("one-token"), std::string("Bearer "), std::string("Bearer x"),
        "Bearer " + Hash("one-token"), std::string("Basic one-token")}) {
    const auto created = As(token, &Stub::CreateSession, v1::CreateSessionRequest());
    EXPECT_EQ(created.status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << token;
    EXPECT_EQ(ReasonOf(created.status), "INVALID_TOKEN");
    EXPECT_EQ(As(token, &Stub::GetServerInfo, v1::GetServerInfoRequest()).status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(As(token, &Stub::Step, StepsOf(session, {}, 1)).status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED);
  }
  // Streams, too.
  grpc::ClientContext context;
  const auto stream = stub_->StepStream(&context);
  v1::StepResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
  grpc::ClientContext states_context;
  const auto states = stub_->StreamStates(&states_context);
  v1::StateChunk chunk;
  EXPECT_FALSE(states->Read(&chunk));
  EXPECT_EQ(states->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
  grpc::ClientContext read_context;
  const auto read = stub_->ReadStates(&read_context, v1::ReadStatesRequest());
  EXPECT_FALSE(read->Read(&chunk));
  EXPECT_EQ(read->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
}

TEST_F(Tenants, WhatIsOfAnotherTenantIsNotThere) {
  Start();
  const std::string mine = SessionOf(kOne), theirs = SessionOf(kTwo);
  const auto cloths = As(kTwo, &Stub::CreateCloths, HangingSheet(theirs, 4));
  ASSERT_TRUE(cloths.status.ok());
  const uint64_t id = cloths.value.cloth_ids(0);
  const auto expect_none = [](const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_EQ(ReasonOf(status), "SESSION_NOT_FOUND");
  };
  v1::GetSessionRequest get;
  get.set_name(theirs);
  expect_none(As(kOne, &Stub::GetSession, get).status);
  v1::RenewSessionRequest renew;
  renew.set_name(theirs);
  expect_none(As(kOne, &Stub::RenewSession, renew).status);
  v1::DeleteSessionRequest remove;
  remove.set_name(theirs);
  expect_none(As(kOne, &Stub::DeleteSession, remove).status);
  expect_none(As(kOne, &Stub::CreateCloths, HangingSheet(theirs, 4)).status);
  expect_none(As(kOne, &Stub::Step, StepsOf(theirs, {id}, 1)).status);
  v1::GetClothRequest cloth;
  cloth.set_session(theirs);
  cloth.set_cloth_id(id);
  expect_none(As(kOne, &Stub::GetCloth, cloth).status);
  v1::ListClothsRequest list;
  list.set_session(theirs);
  expect_none(As(kOne, &Stub::ListCloths, list).status);
  v1::ResetClothsRequest reset;
  reset.set_session(theirs);
  reset.add_cloth_ids(id);
  expect_none(As(kOne, &Stub::ResetCloths, reset).status);
  v1::DeleteClothsRequest remove_cloth;
  remove_cloth.set_session(theirs);
  remove_cloth.add_cloth_ids(id);
  expect_none(As(kOne, &Stub::DeleteCloths, remove_cloth).status);
  v1::RenderRequest render;
  render.set_session(theirs);
  const grpc::Status drawn = As(kOne, &Stub::Render, render).status;
  EXPECT_TRUE(ReasonOf(drawn) == "SESSION_NOT_FOUND" || ReasonOf(drawn) == "INVALID_FIELDS");

  const auto sessions = As(kOne, &Stub::ListSessions, v1::ListSessionsRequest());
  ASSERT_EQ(sessions.value.sessions_size(), 1);
  EXPECT_EQ(mine.rfind(sessions.value.sessions(0).name().substr(0, 20), 0), 0u);
  const auto info = As(kOne, &Stub::GetServerInfo, v1::GetServerInfoRequest());
  EXPECT_EQ(info.value.session_count(), 1u);
  EXPECT_EQ(info.value.cloth_count(), 0u);
  EXPECT_TRUE(As(kTwo, &Stub::Step, StepsOf(theirs, {id}, 1)).status.ok());
}

TEST_F(Tenants, ATenantHasQuotasOfItsOwn) {
  Start({"--max-sessions=8", "--max-cloths-per-tenant=3"});
  const std::string one = SessionOf(kOne), other = SessionOf(kOne);
  const auto third = As(kOne, &Stub::CreateSession, v1::CreateSessionRequest());
  EXPECT_EQ(ReasonOf(third.status), "QUOTA_EXCEEDED");
  EXPECT_THAT(third.status.error_message(), HasSubstr("max_sessions_per_tenant is 2"));
  const std::string theirs = SessionOf(kTwo);
  EXPECT_TRUE(As(kOne, &Stub::CreateCloths, HangingSheet(one, 4, 2)).status.ok());
  const auto more = As(kOne, &Stub::CreateCloths, HangingSheet(other, 4, 2));
  EXPECT_EQ(ReasonOf(more.status), "QUOTA_EXCEEDED");
  EXPECT_THAT(more.status.error_message(), HasSubstr("max_cloths_per_tenant is 3"));
  EXPECT_TRUE(As(kTwo, &Stub::CreateCloths, HangingSheet(theirs, 4, 2)).status.ok());
  v1::DeleteSessionRequest remove;
  remove.set_name(one);
  EXPECT_TRUE(As(kOne, &Stub::DeleteSession, remove).status.ok());
  EXPECT_TRUE(As(kOne, &Stub::CreateCloths, HangingSheet(other, 4, 2)).status.ok());
  SessionOf(kOne);
}

// A rate of a microsecond of building per second, 60 of them at once.
TEST_F(Tenants, ATenantBeyondItsTimeOfTheBuildersIsRefusedAndOthersAreNot) {
  Start();
  WriteTokens("one " + Hash("one-token") + " builder_s_per_s=1e-6\ntwo " + Hash("two-token") +
              "\n");
  server_->Signal(SIGHUP);
  const auto limit_of = [&](const std::string& token) {
    const auto info = As(token, &Stub::GetServerInfo, v1::GetServerInfoRequest());
    return info.value.limits().max_builder_s_per_s();
  };
  while (limit_of(kOne) != 1e-6) std::this_thread::yield();
  EXPECT_EQ(limit_of(kTwo), 1) << "the default";
  const std::string greedy = SessionOf(kOne), modest = SessionOf(kTwo);
  // The answer may come just before its build is counted.
  auto created = As(kOne, &Stub::CreateCloths, HangingSheet(greedy));
  ASSERT_TRUE(created.status.ok());
  for (int k = 0; k < 100 && created.status.ok(); ++k) {
    created = As(kOne, &Stub::CreateCloths, HangingSheet(greedy));
  }
  EXPECT_EQ(created.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(created.status), "BUILD_TIME_EXCEEDED");
  EXPECT_NE(created.status.error_details().find("google.rpc.RetryInfo"), std::string::npos);
  EXPECT_TRUE(As(kOne, &Stub::Step, StepsOf(greedy, {}, 1)).status.ok()) << "builds nothing";
  EXPECT_TRUE(As(kTwo, &Stub::CreateCloths, HangingSheet(modest)).status.ok());
}

// A rate of 8 * 8 particles * 4 substeps * 20 steps/s.
TEST_F(Tenants, ATenantBeyondItsRateWaitsAndOthersDoNot) {
  Start({"--max-queue-delay-us=0"});
  WriteTokens("one " + Hash("one-token") + " particle_substeps_per_s=5120\ntwo " +
              Hash("two-token") + "\nslow " + Hash("slow") + " particle_substeps_per_s=1\n");
  server_->Signal(SIGHUP);
  const auto limit_of_one = [&] {
    const auto info = As(kOne, &Stub::GetServerInfo, v1::GetServerInfoRequest());
    return info.value.limits().max_particle_substeps_per_s();
  };
  while (limit_of_one() == 0) std::this_thread::yield();
  EXPECT_EQ(limit_of_one(), 5120);
  EXPECT_EQ(As(kTwo, &Stub::GetServerInfo, v1::GetServerInfoRequest())
                .value.limits()
                .max_particle_substeps_per_s(),
            0);
  const std::string greedy = SessionOf(kOne), modest = SessionOf(kTwo);
  ASSERT_TRUE(As(kOne, &Stub::CreateCloths, HangingSheet(greedy)).status.ok());
  ASSERT_TRUE(As(kTwo, &Stub::CreateCloths, HangingSheet(modest)).status.ok());
  using std::chrono::steady_clock;
  const auto begin = steady_clock::now();
  auto call = std::async(std::launch::async, [&] {
    return As(kOne, &Stub::Step, StepsOf(greedy, {}, 61)).status.ok();
  });
  for (int k = 0; k < 20; ++k) {
    EXPECT_TRUE(As(kTwo, &Stub::Step, StepsOf(modest, {}, 1)).status.ok());
  }
  // 20 steps at once, one on credit, and 40 at 20 a second.
  EXPECT_EQ(call.wait_until(begin + std::chrono::milliseconds(1900)), std::future_status::timeout);
  call.wait();
  EXPECT_TRUE(call.get());
  // A step of 256 s of work leaves a debt beyond the deadline of the next.
  const std::string kSlow = "Bearer slow", slow = SessionOf(kSlow);
  ASSERT_TRUE(As(kSlow, &Stub::CreateCloths, HangingSheet(slow)).status.ok());
  EXPECT_TRUE(As(kSlow, &Stub::Step, StepsOf(slow, {}, 1)).status.ok());
  const auto refused = As(kSlow, &Stub::Step, StepsOf(slow, {}, 1));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(refused.status), "RATE_EXCEEDED");
  EXPECT_NE(refused.status.error_details().find("google.rpc.RetryInfo"), std::string::npos);
}

TEST_F(Tenants, TokensAreReadAgainAtSighup) {
  Start();
  const std::string session = SessionOf(kOne);
  const auto log_has = [&](const std::string& text) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (server_->Log().find(text) == std::string::npos) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return true;
  };
  WriteTokens("one " + Hash("new-token") + "\n");
  server_->Signal(SIGHUP);
  ASSERT_TRUE(log_has("tokens_read count=1"));
  EXPECT_EQ(As(kOne, &Stub::Step, StepsOf(session, {}, 1)).status.error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(As("Bearer new-token", &Stub::Step, StepsOf(session, {}, 1)).status.ok());
  WriteTokens("broken\n");
  server_->Signal(SIGHUP);
  ASSERT_TRUE(log_has("tokens_kept"));
  EXPECT_TRUE(As("Bearer new-token", &Stub::Step, StepsOf(session, {}, 1)).status.ok());
  EXPECT_EQ(server_->Log().find("token\""), std::string::npos) << "no token is logged";
}

TEST_F(Tenants, WhatIsUnderWayEndsWithItsToken) {
  Start();
  const std::string session = SessionOf(kOne);
  const auto created = As(kOne, &Stub::CreateCloths, HangingSheet(session, 4));
  ASSERT_TRUE(created.status.ok());
  const Ids ids(created.value.cloth_ids().begin(), created.value.cloth_ids().end());
  grpc::ClientContext of_stream, of_run;
  of_stream.AddMetadata("authorization", kOne);
  of_run.AddMetadata("authorization", kOne);
  const auto stream = stub_->StepStream(&of_stream);
  v1::StepResponse response;
  ASSERT_TRUE(stream->Write(StepsOf(session, ids, 1)) && stream->Read(&response));
  const auto run = stub_->Run(&of_run);
  v1::RunRequest start;
  start.mutable_start()->set_session(session);
  start.mutable_start()->add_cloth_ids(ids[0]);
  start.mutable_start()->set_steps_hz(100);
  v1::RunReport report;
  ASSERT_TRUE(run->Write(start) && run->Read(&report));
  WriteTokens("two " + Hash("two-token") + "\n");
  server_->Signal(SIGHUP);
  while (run->Read(&report)) {
  }
  EXPECT_EQ(run->Finish().error_code(), grpc::StatusCode::UNAUTHENTICATED);
  stream->Write(StepsOf(session, ids, 1));
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(ReasonOf(status), "INVALID_TOKEN");
}

TEST_F(Tenants, ABrokenTokenFileIsNoReasonToServeEverybody) {
  WriteTokens("one two three\n");
  ServerProcess server({"--token-file=" + (dir_ / "tokens")});
  EXPECT_EQ(server.WaitForExit(), 1);
  EXPECT_THAT(server.Log(), HasSubstr("TOKEN_FILE_FAILED"));
}

TEST_F(Tenants, MetricsTellNoSecrets) {
  Start({"--metrics-listen=127.0.0.1:0", "--server-id=a7"});
  const std::string session = SessionOf(kOne);
  EXPECT_EQ(session.rfind("sessions/a7-", 0), 0u);
  EXPECT_TRUE(As(kOne, &Stub::Step, StepsOf(session, {}, 1)).status.ok());
  const std::string metrics = MetricsOf(*server_);
  EXPECT_THAT(metrics, HasSubstr("drape_sessions 1\n"));
  EXPECT_THAT(metrics, HasSubstr("server_id=\"a7\""));
  EXPECT_EQ(metrics.find(session.substr(12)), std::string::npos);
  EXPECT_EQ(metrics.find("token"), std::string::npos);
  v1::GetSessionRequest get;
  get.set_name("sessions/b3-0123456789abcdef0123456789abcdef");
  EXPECT_EQ(ReasonOf(As(kOne, &Stub::GetSession, get).status), "WRONG_SERVER");
}

}  // namespace
}  // namespace drape::test
