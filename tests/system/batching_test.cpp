// Step requests of different clients that wait together are stepped in one batch.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

constexpr uint32_t kClients = 16;

struct Client {
  std::unique_ptr<Stub> stub;
  std::string session;
  Ids ids;
};

Client NewClient(InProcessServer& server, uint32_t cloth_count) {
  Client client{server.NewStub(), "", {}};
  client.session = NewSession(*client.stub);
  client.ids = Create(*client.stub, HangingSheet(client.session, 8, cloth_count));
  return client;
}

// Holds the device thread until every client's request for one step waits, then lets it go.
std::vector<v1::StepResponse> StepTogether(InProcessServer& server, std::vector<Client>& clients) {
  std::vector<v1::StepResponse> responses(clients.size());
  std::vector<std::thread> threads;
  server.scheduler().HoldForTest();
  for (size_t k = 0; k < clients.size(); ++k) {
    threads.emplace_back([&, k] {
      responses[k] = Step(*clients[k].stub, StepsOf(clients[k].session, clients[k].ids, 1));
    });
  }
  while (server.scheduler().counters().queued_requests < clients.size()) std::this_thread::yield();
  server.scheduler().ReleaseForTest();
  for (std::thread& thread : threads) thread.join();
  return responses;
}

class Batching : public testing::TestWithParam<std::string> {};

TEST_P(Batching, SixteenWaitingClientsShareOneBatchAndGetTheirOwnBits) {
  InProcessServer server(GetParam());
  std::vector<Client> clients;
  for (uint32_t k = 0; k < kClients; ++k) clients.push_back(NewClient(server, 1));
  const uint64_t rounds_before = server.scheduler().counters().rounds;
  for (const v1::StepResponse& response : StepTogether(server, clients)) {
    EXPECT_EQ(response.timing().batch_requests(), kClients);
    EXPECT_EQ(response.timing().batch_cloths(), kClients);
    EXPECT_THAT(response.steps(), testing::ElementsAre(1));
  }
  EXPECT_EQ(server.scheduler().counters().rounds, rounds_before + 1);

  Client alone = NewClient(server, 1);
  Step(*alone.stub, StepsOf(alone.session, alone.ids, 1));
  const std::string bits = Bits(*alone.stub, alone.session, alone.ids);
  for (const Client& client : clients) {
    EXPECT_EQ(Bits(*client.stub, client.session, client.ids), bits);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Batching, testing::ValuesIn(BackendNames()),
                         [](const auto& backend) { return backend.param; });

TEST(GlBatching, TheNumberOfDispatchesDoesNotGrowWithTheCloths) {
  SchedulerLimits limits;
  limits.batch_budget_us = 60'000'000;  // all in one batch, however slow the device is
  InProcessServer server("gl", limits);
  std::vector<Client> one;
  one.push_back(NewClient(server, 1));
  const v1::StepResponse single = StepTogether(server, one).at(0);
  ASSERT_EQ(single.timing().batch_cloths(), 1u);
  ASSERT_GE(single.timing().batch_dispatches(), 1u);

  std::vector<Client> many;
  for (uint32_t k = 0; k < kClients; ++k) many.push_back(NewClient(server, 256 / kClients));
  for (const v1::StepResponse& response : StepTogether(server, many)) {
    EXPECT_EQ(response.timing().batch_cloths(), 256u);
    EXPECT_EQ(response.timing().batch_requests(), kClients);
    EXPECT_EQ(response.timing().batch_dispatches(), single.timing().batch_dispatches());
  }
}

TEST(Batching, AFullQueueIsRefusedWithAHintWhenToRetry) {
  SchedulerLimits limits;
  limits.max_queued_requests_per_session = 2;
  InProcessServer server("cpu", limits);
  Client client = NewClient(server, 3);
  server.scheduler().HoldForTest();
  std::vector<std::thread> threads;
  for (uint32_t k = 0; k < 2; ++k) {
    threads.emplace_back(
        [&, k] { Step(*client.stub, StepsOf(client.session, {client.ids[k]}, 1)); });
  }
  while (server.scheduler().counters().queued_requests < 2) std::this_thread::yield();
  const auto refused = Call(*client.stub, &Stub::Step, StepsOf(client.session, {client.ids[2]}, 1));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(refused.status), "QUEUE_FULL");
  EXPECT_THAT(refused.status.error_details(), testing::HasSubstr("google.rpc.RetryInfo"));
  server.scheduler().ReleaseForTest();
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace drape::test
