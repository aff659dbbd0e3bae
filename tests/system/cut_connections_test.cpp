// Requests with ids through a proxy that cuts connections: each is done once.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/cutting_proxy.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

constexpr int kWorkers = 4;
constexpr int kRequestsPerWorker = 150;

std::unique_ptr<Stub> StubThrough(const CuttingProxy& proxy) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 10);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 10);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
  return v1::SimulationService::NewStub(
      grpc::CreateCustomChannel(proxy.Address(), grpc::InsecureChannelCredentials(), arguments));
}

// Repeats the request until it is answered. Returns how often it was sent.
int StepUntilAnswered(Stub& stub, const v1::StepRequest& request) {
  for (int sent = 1;; ++sent) {
    const auto answer = Call(stub, &Stub::Step, request);
    if (answer.status.ok()) return sent;
    const bool may_repeat = answer.status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                            ReasonOf(answer.status) == "REQUEST_IN_PROGRESS";
    if (!may_repeat || sent > 10000) {
      ADD_FAILURE() << answer.status.error_code() << ": " << answer.status.error_message();
      return sent;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

TEST(CutConnections, EveryRequestIsDoneOnce) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto direct = server.NewStub();
  const std::string session = NewSession(*direct);
  const Ids ids = Create(*direct, HangingSheet(session, 4, 1 + kWorkers));
  CuttingProxy proxy(PortOf(server.Address()));
  std::atomic<int> repetitions = 0;
  std::vector<std::thread> workers;
  for (int w = 0; w < kWorkers; ++w) {
    workers.emplace_back([&, w] {
      const auto stub = StubThrough(proxy);
      for (int k = 0; k < kRequestsPerWorker; ++k) {
        // The first cloth is everybody's.
        v1::StepRequest request = StepsOf(session, {ids[0], ids[static_cast<size_t>(1 + w)]}, 1);
        request.set_request_id(std::to_string(w) + "/" + std::to_string(k));
        repetitions += StepUntilAnswered(*stub, request) - 1;
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  EXPECT_EQ(Get(*direct, session, ids[0]).step(), uint64_t{kWorkers * kRequestsPerWorker});
  for (size_t w = 0; w < kWorkers; ++w) {
    EXPECT_EQ(Get(*direct, session, ids[1 + w]).step(), uint64_t{kRequestsPerWorker});
  }
  EXPECT_GT(proxy.cuts(), 20) << "the connections were hardly cut";
  EXPECT_GT(repetitions, 20) << "hardly a request had to be repeated";
}

// What was given up and arrives after its repetition and a later request: it would undo that.
TEST(CutConnections, ASendingThatArrivesLateDoesNothing) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const uint64_t id = Create(*stub, HangingSheet(session, 4))[0];
  Step(*stub, StepsOf(session, {id}, 3));
  const auto do_twice = [&](auto method, auto request, const std::string& request_id,
                            const std::function<void()>& meanwhile) {
    SCOPED_TRACE(request_id);
    request.set_session(session);
    request.set_request_id(request_id);
    ASSERT_TRUE(Call(*stub, method, request).status.ok());
    meanwhile();
    const std::string before = Bits(*stub, session, {id}) + Get(*stub, session, id).DebugString();
    const auto late = Call(*stub, method, request);
    EXPECT_TRUE(late.status.ok()) << late.status.error_message();
    EXPECT_TRUE(Bits(*stub, session, {id}) + Get(*stub, session, id).DebugString() == before);
    request.set_session(session + "x");
    EXPECT_EQ(ReasonOf(Call(*stub, method, request).status), "SESSION_NOT_FOUND");
  };
  const auto step = [&] { Step(*stub, StepsOf(session, {id}, 2)); };

  v1::ResetClothsRequest reset;
  reset.add_cloth_ids(id);
  do_twice(&Stub::ResetCloths, reset, "reset", step);

  v1::UpdateClothsRequest update;
  update.add_cloth_ids(id);
  update.mutable_update_mask()->add_paths("material.damping_per_s");
  update.mutable_update_mask()->add_paths("environment.gravity_m_per_s2");
  Set(update.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, -1, 0});
  do_twice(&Stub::UpdateCloths, update, "update", [&] {
    v1::UpdateClothsRequest other = update;
    other.set_session(session);
    Set(other.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, -2, 0});
    ASSERT_TRUE(Call(*stub, &Stub::UpdateCloths, other).status.ok());
  });

  v1::SaveStatesRequest save;
  save.set_name("a");
  save.add_cloth_ids(id);
  const uint64_t saved_at = Get(*stub, session, id).step();
  do_twice(&Stub::SaveStates, save, "save", step);
  v1::LoadStatesRequest load;
  load.set_name("a");
  load.add_cloth_ids(id);
  do_twice(&Stub::LoadStates, load, "load", [&] {
    EXPECT_EQ(Get(*stub, session, id).step(), saved_at)
        << "the late saving replaced what was saved";
    step();
  });

  v1::DropStatesRequest drop;
  drop.set_name("a");
  do_twice(&Stub::DropStates, drop, "drop", [&] {
    v1::SaveStatesRequest again = save;
    again.set_session(session);
    ASSERT_TRUE(Call(*stub, &Stub::SaveStates, again).status.ok());
  });
  load.set_session(session);
  EXPECT_TRUE(Call(*stub, &Stub::LoadStates, load).status.ok()) << "the late one dropped the next";

  v1::WriteStatesRequest write;
  write.add_cloth_ids(id);
  *write.mutable_positions_m() = Read(*stub, session, {id})[0].positions_m();
  do_twice(&Stub::WriteStates, write, "write", step);

  // A deletion that was done and is repeated is no error.
  v1::DeleteClothsRequest deletion;
  deletion.set_session(session);
  deletion.add_cloth_ids(id);
  deletion.set_request_id("delete");
  EXPECT_TRUE(Call(*stub, &Stub::DeleteCloths, deletion).status.ok());
  EXPECT_TRUE(Call(*stub, &Stub::DeleteCloths, deletion).status.ok());
  deletion.set_request_id("another");
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::DeleteCloths, deletion).status), "CLOTH_NOT_FOUND");
}

}  // namespace
}  // namespace drape::test
