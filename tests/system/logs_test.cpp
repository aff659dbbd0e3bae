// What the log says of requests, and what it never says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "server/api/sha256.h"
#include "server/core/text.h"
#include "tests/system/calls.h"
#include "tests/system/random_traffic.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

// The digits of a session's name.
std::string SecretOf(const std::string& session) {
  return session.substr(session.rfind('-') + 1);
}

class Logs : public testing::TestWithParam<std::string> {
 protected:
  static constexpr char kToken[] = "open-sesame-of-the-lab", kWrongToken[] = "open-poppy";

  void SetUp() override {
    std::ofstream tokens(dir_ / "tokens");
    tokens << "lab " << HexOf(api::Sha256Of(kToken)) << "\n";
    tokens.close();
    server_ = std::make_unique<ServerProcess>(std::vector<std::string>{
        "--backend=cpu", "--log-level=debug", "--log-format=" + GetParam(),
        "--token-file=" + (dir_ / "tokens"), "--checkpoint-dir=" + (dir_ / "kept"),
        "--checkpoint-interval-s=0.1"});
    ASSERT_TRUE(server_->WaitUntilUp());
    stub_ = server_->NewStub();
  }

  template <class Request, class Response>
  Answer<Response> As(const std::string& token,
                      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request) {
    return Call(*stub_, method, request, "Bearer " + token);
  }

  std::string NewLabSession(const std::string& display_name) {
    v1::CreateSessionRequest request;
    request.set_display_name(display_name);
    const auto answer = As(kToken, &Stub::CreateSession, request);
    secrets_.insert(SecretOf(answer.value.name()));
    return answer.value.name();
  }

  // Good requests, and such as have secrets where they do not belong.
  void Traffic(uint32_t seed) {
    std::mt19937 random(seed);
    RandomTraffic traffic(seed, true);
    const std::string session = NewLabSession("session \"" + std::to_string(seed) + "\"\nnext");
    const std::string other = NewLabSession(session);
    v1::CreateClothsRequest creation = traffic.Creation(session);
    creation.set_request_id("create-" + std::to_string(seed));
    const auto created = As(kToken, &Stub::CreateCloths, creation);
    const Ids ids(created.value.cloth_ids().begin(), created.value.cloth_ids().end());
    for (int k = 0; k < 20; ++k) {
      v1::StepRequest step = traffic.Steps(session, ids);
      step.set_request_id("step-" + std::to_string(seed) + "-" + std::to_string(k));
      switch (random() % 8) {
        case 0:
          step.set_request_id(other);  // a name as an id
          break;
        case 1:
          step.set_session(std::string(20, 'y') + session);
          break;
        case 2:
          step.set_session("x" + session + "\n" + other);
          break;
        case 3:
          step.add_cloth_ids(~uint64_t{0});
          break;
        case 4:
          step.set_session(other);
          break;
        default:
          break;
      }
      As(random() % 8 == 0 ? kWrongToken : kToken, &Stub::Step, step);
    }
    v1::GetSessionRequest get;
    get.set_name(other);
    As(kToken, &Stub::GetSession, get);
    v1::ListSessionsRequest list;
    list.set_page_token(session);
    As(kToken, &Stub::ListSessions, list);
    v1::SaveStatesRequest save;
    save.set_session(session);
    save.set_all_cloths(true);
    save.set_name(session);
    As(kToken, &Stub::SaveStates, save);
    v1::LoadStatesRequest load;
    load.set_session(session);
    load.set_all_cloths(true);
    load.set_name(other);
    As(kToken, &Stub::LoadStates, load);
    v1::RenderRequest render;
    render.set_session(session);
    As(kToken, &Stub::Render, render);
    grpc::ClientContext context;
    context.AddMetadata("authorization", std::string("Bearer ") + kToken);
    const auto stream = stub_->StepStream(&context);
    stream->Write(StepsOf(session, ids, 1));
    stream->Write(StepsOf(other + session, ids, 1));
    stream->WritesDone();
    v1::StepResponse response;
    while (stream->Read(&response)) {
    }
    stream->Finish();
    v1::DeleteSessionRequest remove;
    remove.set_name(other);
    As(kToken, &Stub::DeleteSession, remove);
  }

  ScratchDir dir_;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<Stub> stub_;
  std::set<std::string> secrets_;
};
INSTANTIATE_TEST_SUITE_P(Formats, Logs, testing::Values("text", "json"),
                         [](const auto& format) { return format.param; });

TEST_P(Logs, HaveNoNameInFullAndNoToken) {
  for (uint32_t seed = 0; seed < 4; ++seed) Traffic(seed);
  server_->Signal(SIGUSR1);
  server_->Signal(SIGTERM);
  EXPECT_EQ(server_->WaitForExit(), 0);
  const std::string log = server_->Log();
  ASSERT_EQ(secrets_.size(), 8u);
  EXPECT_NE(log.find("call_refused"), std::string::npos) << "calls with a wrong token";
  for (const std::string& secret : secrets_) {
    ASSERT_EQ(secret.size(), 32u);
    EXPECT_EQ(log.find(secret), std::string::npos) << "a name in full";
    EXPECT_EQ(log.find(secret.substr(0, 8)), std::string::npos) << "too much of a name";
    EXPECT_NE(log.find("-" + secret.substr(0, 4) + "..."), std::string::npos) << "no tag at all";
  }
  for (const char* token : {kToken, kWrongToken, "sesame", "poppy", "Bearer"}) {
    EXPECT_EQ(log.find(token), std::string::npos) << token;
  }
  // One line each, whatever is in the texts.
  std::istringstream lines(log);
  std::set<std::string> of_steps;
  size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    if (GetParam() == "text") {
      EXPECT_EQ(line.find("20"), 0u) << line;
      if (line.find(" request method=Step ") != std::string::npos) of_steps.insert(line);
      continue;
    }
    const Json object = Json::parse(line, nullptr, /*allow_exceptions=*/false);
    ASSERT_TRUE(object.is_object()) << line;
    for (const char* key : {"time", "level", "event"}) ASSERT_TRUE(object.contains(key)) << line;
    if (object["event"] != "request" || object["method"] != "Step") continue;
    EXPECT_EQ(object["tenant"], "lab");
    EXPECT_TRUE(object["session"].is_string()) << line;
    EXPECT_TRUE(object["ms"].is_number()) << line;
    EXPECT_TRUE(object["code"].is_string()) << line;
    of_steps.insert(object.value("request_id", ""));
  }
  EXPECT_GT(count, 100u);
  EXPECT_GT(of_steps.size(), 30u);
  EXPECT_THAT(log, HasSubstr("step-3-1"));
}

}  // namespace
}  // namespace drape::test
