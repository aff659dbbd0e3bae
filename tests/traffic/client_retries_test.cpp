// What the client library sends again by itself over connections that are cut.
#include <drape/client.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/cutting_proxy.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

constexpr size_t kNoCut = size_t{1} << 50;

// Pauses as short as a cut on one machine deserves, and a budget that does not end.
ConnectOptions Patient() {
  ConnectOptions options;
  options.retries.max_tries = 100;
  options.retries.first_pause_s = 0.001;
  options.retries.max_pause_s = 0.05;
  options.retries.budget = 1e9;
  return options;
}

class ClientRetries : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    Session session = Client::Connect(server_.Address()).CreateSession();
    session.Detach();
    name_ = session.name();
    cloth_ = session.CreateCloths(HangingSheet(name_, 16)).cloth_ids(0);
  }

  uint64_t StepsMade() const {
    return Client::Connect(server_.Address()).AttachSession(name_).GetCloth(cloth_).step();
  }

  ServerProcess server_{{"--backend=cpu"}};
  std::string name_;
  ClothId cloth_ = 0;
};

TEST_F(ClientRetries, ReadsAreRepeated) {
  CuttingProxy proxy(PortOf(server_.Address()), 4'000, 40'000);
  const Client client = Client::Connect(proxy.Address(), Patient());
  const Session session = client.AttachSession(name_);
  for (int k = 0; k < 200; ++k) {
    EXPECT_EQ(session.GetCloth(cloth_).id(), cloth_);
    EXPECT_EQ(session.ReadStates().size(), 1u);
    EXPECT_GE(client.ListSessions().size(), 1u);
  }
  EXPECT_GT(proxy.cuts(), 10) << "the connections were hardly cut";
}

TEST_F(ClientRetries, ChangesWithAnIdAreDoneOnce) {
  ConnectOptions options = Patient();
  options.retries.gives_request_ids = true;
  CuttingProxy proxy(PortOf(server_.Address()), 1'000, 20'000);
  const Client client = Client::Connect(proxy.Address(), options);
  Session session = client.AttachSession(name_);
  v1::StepRequest request;
  request.add_cloth_ids(cloth_);
  request.set_steps(1);
  request.mutable_view()->set_positions(true);
  for (uint64_t k = 1; k <= 200; ++k) {
    ASSERT_EQ(session.Step(request).steps(0), k);
  }
  EXPECT_GT(proxy.cuts(), 20) << "the connections were hardly cut";
  EXPECT_EQ(StepsMade(), 200u);
  const std::string snapshot = session.TakeSnapshot();
  const size_t restored = session.Restore(snapshot).cloths.size();
  EXPECT_EQ(session.ListCloths().size(), 1 + restored);
  session.DeleteCloths(std::vector<ClothId>{cloth_});
  EXPECT_EQ(session.ListCloths().size(), restored);
}

TEST_F(ClientRetries, StepsToAGivenStepAreRepeated) {
  CuttingProxy proxy(PortOf(server_.Address()), 1'000, 20'000);
  const Client client = Client::Connect(proxy.Address(), Patient());
  Session session = client.AttachSession(name_);
  v1::StepRequest request;
  request.add_cloth_ids(cloth_);
  for (uint64_t k = 1; k <= 200; ++k) {
    request.set_until_step(k);
    ASSERT_EQ(session.Step(request).steps(0), k);
  }
  EXPECT_GT(proxy.cuts(), 10) << "the connections were hardly cut";
}

// Without an id nobody could tell whether it was done.
TEST_F(ClientRetries, OtherStepsAreNot) {
  CuttingProxy proxy(PortOf(server_.Address()));
  const Client client = Client::Connect(proxy.Address(), Patient());
  Session session = client.AttachSession(name_);
  uint64_t acknowledged = 0, failed = 0;
  for (int k = 0; k < 200; ++k) {
    try {
      (void)session.Step(1);
      ++acknowledged;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kUnavailable) << error.what();
      EXPECT_EQ(error.details().unanswered_tries, 0u);
      ++failed;
    }
  }
  EXPECT_GT(failed, 5u);
  EXPECT_GE(StepsMade(), acknowledged);
  EXPECT_LE(StepsMade(), acknowledged + failed);
}

// Cuts before the request, within it, between it and its answer, and within the answer.
TEST_F(ClientRetries, ACutAnywhereBringsTheAnswerThatIsRemembered) {
  CuttingProxy proxy(PortOf(server_.Address()), kNoCut, kNoCut);
  Session session = Client::Connect(proxy.Address(), Patient()).AttachSession(name_);
  Session direct = Client::Connect(server_.Address()).AttachSession(name_);
  int cut_requests = 0, cut_answers = 0;
  uint64_t step = 0;
  v1::StepRequest request;
  request.add_cloth_ids(cloth_);
  request.set_steps(1);
  request.mutable_view()->set_positions(true);
  constexpr size_t kAnswerBytes = 16 * 16 * 3 * sizeof(float);
  const std::string long_id(100, 'x');
  for (size_t bytes = 1; bytes < 2 * kAnswerBytes; bytes += 1 + bytes / 30) {
    request.set_request_id(long_id + std::to_string(bytes));
    (void)session.GetCloth(cloth_);  // the connection is there
    const int cuts = proxy.cuts();
    proxy.CutOnceAfter(bytes);
    const v1::StepResponse answer = session.Step(request);
    ASSERT_EQ(answer.steps(0), ++step) << "cut after " << bytes;
    EXPECT_EQ(direct.Step(request).SerializeAsString(), answer.SerializeAsString())
        << "cut after " << bytes;
    if (proxy.cuts() == cuts) continue;  // it was not that long
    cut_requests += proxy.received_before_cut() == 0 ? 1 : 0;
    cut_answers += proxy.received_before_cut() > kAnswerBytes / 8 ? 1 : 0;
  }
  EXPECT_EQ(StepsMade(), step);
  EXPECT_GT(cut_requests, 10);
  EXPECT_GT(cut_answers, 10);
}

TEST_F(ClientRetries, LargeAnswersThatAreCutComeAgain) {
  CuttingProxy proxy(PortOf(server_.Address()), kNoCut, kNoCut);
  Session session = Client::Connect(proxy.Address(), Patient()).AttachSession(name_);
  const ClothId large = session.CreateCloths(HangingSheet(name_, 320)).cloth_ids(0);  // 1.2 MB
  v1::StepRequest request;
  request.add_cloth_ids(large);
  request.set_steps(1);
  request.set_report(true);
  request.mutable_view()->set_positions(true);
  uint64_t step = 0;
  for (const size_t bytes : {100, 5'000, 500'000, 1'000'000, 1'100'000, 1'200'000}) {
    (void)session.GetCloth(large);  // the connection is there
    proxy.CutOnceAfter(bytes);
    request.set_request_id(std::to_string(bytes));
    const SteppedStates stepped = session.StepStates(request);
    EXPECT_EQ(stepped.answer.steps(0), ++step) << "cut after " << bytes;
    EXPECT_EQ(stepped.answer.reports_size(), 1);
    ASSERT_EQ(stepped.states.size(), 1u);
    const States now = session.ReadStates(std::vector<ClothId>{large});
    EXPECT_TRUE(
        std::ranges::equal(stepped.states[0].positions_m.floats(), now[0].positions_m.floats()));
  }
  EXPECT_EQ(proxy.cuts(), 6);
}

// The session came back as it was: what was done since is not silently missing.
TEST(ClientRetriesOverAnEnd, SayWhatIsLost) {
  ScratchDir dir;
  const std::vector<std::string> flags = {"--backend=cpu", "--server-id=one",
                                          "--checkpoint-dir=" + (dir / "checkpoints"),
                                          "--checkpoint-interval-s=3600"};
  auto server = std::make_unique<ServerProcess>(flags);
  ASSERT_TRUE(server->WaitUntilUp());
  CuttingProxy proxy(PortOf(server->Address()), kNoCut, kNoCut);
  ConnectOptions options = Patient();
  options.retries.gives_request_ids = true;
  const Client client = Client::Connect(proxy.Address(), options);
  Session session = client.CreateSession();
  session.CreateCloths(HangingSheet(session.name(), 4));
  (void)session.Step(3);
  server->Signal(SIGTERM);  // writes the checkpoint
  server->WaitForExit();
  proxy.SetTarget(0);
  server = std::make_unique<ServerProcess>(flags);
  ASSERT_TRUE(server->WaitUntilUp());
  proxy.SetTarget(PortOf(server->Address()));
  EXPECT_THROW((void)session.Step(1), StateLost);
  (void)session.Reattach();
  (void)session.Step(4);
  server->Signal(SIGKILL);  // the checkpoint is the one of step 3
  server->WaitForExit();
  proxy.SetTarget(0);
  server = std::make_unique<ServerProcess>(flags);
  ASSERT_TRUE(server->WaitUntilUp());
  proxy.SetTarget(PortOf(server->Address()));
  try {
    (void)session.Step(1);
    FAIL() << "it went on silently";
  } catch (const StateLost& error) {
    const auto& metadata = error.details().metadata;
    EXPECT_EQ(metadata.at("told_step"), "7") << error.what();
    EXPECT_NE(std::string(error.what()).find("its cloths are now at steps 3 to 3"),
              std::string::npos)
        << error.what();
  }
  (void)session.Reattach();
  EXPECT_EQ(session.Step(1).steps(0), 4u);

  // Another server: nothing of it is left.
  server->Signal(SIGKILL);
  server->WaitForExit();
  proxy.SetTarget(0);
  server = std::make_unique<ServerProcess>(std::vector<std::string>{"--backend=cpu"});
  ASSERT_TRUE(server->WaitUntilUp());
  proxy.SetTarget(PortOf(server->Address()));
  try {
    (void)session.Step(1);
    FAIL() << "it went on silently";
  } catch (const SessionLost& error) {
    EXPECT_EQ(error.details().metadata.at("told_step"), "4") << error.what();
  }
}

}  // namespace
}  // namespace drape::test
