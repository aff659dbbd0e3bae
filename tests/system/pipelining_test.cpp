// Step requests of the same cloths that are under way together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "server/api/limits.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;

using Steps = std::vector<v1::StepRequest>;

void WaitUntilQueued(InProcessServer& server, uint32_t requests) {
  while (server.scheduler().counters().queued_requests < requests) std::this_thread::yield();
}

// Requests that each pull the same pin to another place and take one or two steps; between them the
// rest lengths are driven: in another order, or with a control at another step, the bits differ.
Steps PullingRequests(const std::string& session, const Ids& ids) {
  Steps requests;
  for (uint32_t k = 0; k < 8; ++k) {
    v1::StepRequest& request = requests.emplace_back(StepsOf(session, ids, 1 + k % 2));
    request.mutable_view()->set_positions(true);
    request.mutable_view()->set_velocities(true);
    v1::PinControls& pins = *request.mutable_pin_controls();
    pins.add_cloth_ids(ids[0]);
    pins.add_particles(0);
    for (const double x_m : {0.02 * k, 0.1 - 0.01 * k * k, 0.03 * (k % 3)}) pins.add_targets_m(x_m);
    pins.add_over_s(0.01 * k);
    if (k % 3 != 1) continue;
    request.mutable_rest_length_scales()->add_cloth_ids(ids[0]);
    request.mutable_rest_length_scales()->add_scales(1 - 0.02 * k);
  }
  return requests;
}

// The states in the answers, one text per request.
std::string StateOf(const v1::StepResponse& response) {
  return std::to_string(response.steps(0)) + response.states().positions_m().data() +
         response.states().velocities_m_per_s().data();
}

std::vector<std::string> OneAfterTheOther(Stub& stub, const Steps& requests) {
  std::vector<std::string> states;
  for (const v1::StepRequest& request : requests) states.push_back(StateOf(Step(stub, request)));
  return states;
}

std::vector<std::string> AllTogether(InProcessServer& server, Stub& stub, const Steps& requests) {
  grpc::ClientContext context;
  const auto stream = stub.StepStream(&context);
  server.scheduler().HoldForTest();
  for (const v1::StepRequest& request : requests) EXPECT_TRUE(stream->Write(request));
  stream->WritesDone();
  WaitUntilQueued(server, static_cast<uint32_t>(requests.size()));
  server.scheduler().ReleaseForTest();
  std::vector<std::string> states;
  for (v1::StepResponse response; stream->Read(&response);) states.push_back(StateOf(response));
  EXPECT_TRUE(stream->Finish().ok());
  return states;
}

class Pipelining : public testing::TestWithParam<std::string> {};

TEST_P(Pipelining, RequestsUnderWayTogetherGiveTheBitsOfOneAfterTheOther) {
  InProcessServer server(GetParam());
  const auto stub = server.NewStub();
  std::vector<std::vector<std::string>> states;
  for (const bool is_together : {false, true}) {
    const std::string session = NewSession(*stub);
    const Steps requests = PullingRequests(session, Create(*stub, HangingSheet(session, 8, 2)));
    states.push_back(is_together ? AllTogether(server, *stub, requests)
                                 : OneAfterTheOther(*stub, requests));
  }
  ASSERT_EQ(states[0].size(), 8u);
  ASSERT_EQ(states[1].size(), 8u);
  for (size_t k = 0; k < 8; ++k) EXPECT_TRUE(states[0][k] == states[1][k]) << "request " << k;
}

INSTANTIATE_TEST_SUITE_P(All, Pipelining, testing::ValuesIn(BackendNames()),
                         [](const auto& backend) { return backend.param; });

TEST(Pipelining, CallsUnderWayTogetherAreAllDone) {
  InProcessServer server("cpu");
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session));
  std::vector<uint64_t> steps(4);
  std::vector<std::thread> threads;
  server.scheduler().HoldForTest();
  for (size_t k = 0; k < steps.size(); ++k) {
    threads.emplace_back([&, k] { steps[k] = Step(*stub, StepsOf(session, ids, 1)).steps(0); });
  }
  WaitUntilQueued(server, 4);
  server.scheduler().ReleaseForTest();
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(steps, testing::UnorderedElementsAre(1, 2, 3, 4));
}

TEST(Pipelining, AStreamHasNoMoreThanItsLimitUnderWay) {
  const uint32_t limit = api::RequestLimits().max_pipelined_steps;
  InProcessServer server("cpu");
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session));
  grpc::ClientContext context;
  const auto stream = stub->StepStream(&context);
  server.scheduler().HoldForTest();
  std::thread writer([&] {
    for (uint32_t k = 0; k < 2 * limit; ++k) stream->Write(StepsOf(session, ids, 1));
    stream->WritesDone();
  });
  WaitUntilQueued(server, limit);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // long for what would be too many
  EXPECT_EQ(server.scheduler().counters().queued_requests, limit);
  server.scheduler().ReleaseForTest();
  v1::StepResponse response;
  for (uint32_t k = 0; k < 2 * limit; ++k) {
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_THAT(response.steps(), ElementsAre(k + 1));
  }
  writer.join();
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

}  // namespace
}  // namespace drape::test
