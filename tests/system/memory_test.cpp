// A server whose memory ends: the request that finds none is refused, and nobody else notices.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/page_faults.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

constexpr uint64_t kMemory_bytes = 700'000'000;

// Asks for more and more memory; the first refusal, or OK if there was none.
using Greed = std::function<grpc::Status(ServerProcess&, const std::string& session)>;

grpc::Status SaveAgainAndAgain(ServerProcess& server, const std::string& session) {
  const auto stub = server.NewStub();
  Create(*stub, HangingSheet(session, 128, 16));
  for (int k = 0; k < 400; ++k) {
    v1::SaveStatesRequest request;
    request.set_session(session);
    request.set_name(std::to_string(k));
    request.set_all_cloths(true);
    const grpc::Status status = Call(*stub, &Stub::SaveStates, request).status;
    if (!status.ok()) return status;
  }
  return grpc::Status::OK;
}

grpc::Status CreateAgainAndAgain(ServerProcess& server, const std::string& session) {
  const auto stub = server.NewStub();
  for (int k = 0; k < 400; ++k) {
    const grpc::Status status =
        Call(*stub, &Stub::CreateCloths, HangingSheet(session, 128, 32)).status;
    if (!status.ok()) return status;
  }
  return grpc::Status::OK;
}

grpc::Status BuildModelsAgainAndAgain(ServerProcess& server, const std::string& session) {
  const auto stub = server.NewStub();
  for (uint32_t k = 0; k < 200; ++k) {
    const grpc::Status status =
        Call(*stub, &Stub::CreateCloths, HangingSheet(session, 200 + k)).status;
    if (!status.ok()) return status;
  }
  return grpc::Status::OK;
}

// Several at once, each of an answer of 50 MB.
grpc::Status StepForAnswersThatAreKept(ServerProcess& server, const std::string& session) {
  const auto stub = server.NewStub();
  Create(*stub, HangingSheet(session, 128, 128));
  std::vector<grpc::Status> ends(8);
  std::vector<std::thread> clients;
  for (size_t c = 0; c < ends.size(); ++c) {
    clients.emplace_back([&, c] {
      const auto own = server.NewStub();
      for (int k = 0; k < 6 && ends[c].ok(); ++k) {
        v1::StepRequest request = StepsOf(session, {}, 1);
        request.set_all_cloths(true);
        request.mutable_view()->set_positions(true);
        request.mutable_view()->set_velocities(true);
        request.set_request_id(std::to_string(c) + "." + std::to_string(k));
        ends[c] = Call(*own, &Stub::Step, request).status;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  for (const grpc::Status& end : ends) {
    if (!end.ok()) return end;
  }
  return grpc::Status::OK;
}

// Snapshots of 100 MB each, several at once.
grpc::Status ExportAgainAndAgain(ServerProcess& server, const std::string& session) {
  const auto stub = server.NewStub();
  Create(*stub, HangingSheet(session, 128, 256));
  v1::SaveStatesRequest save;
  save.set_session(session);
  save.set_name("a");
  save.set_all_cloths(true);
  const grpc::Status saved = Call(*stub, &Stub::SaveStates, save).status;
  if (!saved.ok()) return saved;
  std::vector<grpc::Status> ends(6);
  std::vector<std::thread> clients;
  for (grpc::Status& end : ends) {
    clients.emplace_back([&] {
      const auto own = server.NewStub();
      v1::ExportClothsRequest request;
      request.set_session(session);
      request.set_name("a");
      grpc::ClientContext context;
      const auto reader = own->ExportCloths(&context, request);
      for (v1::SnapshotChunk chunk; reader->Read(&chunk);) {
      }
      end = reader->Finish();
    });
  }
  for (std::thread& client : clients) client.join();
  for (const grpc::Status& end : ends) {
    if (!end.ok()) return end;
  }
  return grpc::Status::OK;
}

const std::map<std::string, Greed> kGreeds = {{"Saves", SaveAgainAndAgain},
                                              {"Cloths", CreateAgainAndAgain},
                                              {"Models", BuildModelsAgainAndAgain},
                                              {"Answers", StepForAnswersThatAreKept},
                                              {"Exports", ExportAgainAndAgain}};

// Backend and greed.
class OutOfMemory : public testing::TestWithParam<std::pair<std::string, std::string>> {
 protected:
  void ExpectThatTheServerLives() {
    if (!kHasGlibcHeap) GTEST_SKIP() << "a sanitizer needs addresses without limits";
    const auto& [backend, greed] = GetParam();
    // Nothing but the memory is to be the limit.
    ServerProcess server({"--backend=" + backend, "--max-builder-s-per-s-per-tenant=0"});
    ASSERT_TRUE(server.WaitUntilUp());
    const auto stub = server.NewStub();
    const std::string other = NewSession(*stub), greedy = NewSession(*stub);
    const Ids ids = Create(*stub, HangingSheet(other));
    server.Limit(RLIMIT_DATA, kMemory_bytes);
    const grpc::Status end = kGreeds.at(greed)(server, greedy);
    EXPECT_EQ(end.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << end.error_code() << ": " << end.error_message() << server.Log();
    ASSERT_TRUE(server.is_running()) << server.Log();
    EXPECT_TRUE(Call(*stub, &Stub::Step, StepsOf(other, ids, 1)).status.ok());
    // With the session goes what it has taken.
    v1::DeleteSessionRequest gone;
    gone.set_name(greedy);
    EXPECT_TRUE(Call(*stub, &Stub::DeleteSession, gone).status.ok());
    const std::string next = NewSession(*stub);
    grpc::Status created;
    for (int k = 0; k < 100; ++k) {  // the reserve is looked for every second
      created = Call(*stub, &Stub::CreateCloths, HangingSheet(next, 64)).status;
      if (created.ok()) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_TRUE(created.ok()) << created.error_message();
    EXPECT_TRUE(Call(*stub, &Stub::Step, StepsOf(other, ids, 1)).status.ok());
  }
};

std::string NameOf(const testing::TestParamInfo<std::pair<std::string, std::string>>& test) {
  return test.param.first + test.param.second;
}

INSTANTIATE_TEST_SUITE_P(Short, OutOfMemory,
                         testing::Values(std::pair("cpu", "Saves"), std::pair("cpu", "Models")),
                         NameOf);
using OutOfMemoryLong = OutOfMemory;
INSTANTIATE_TEST_SUITE_P(Greeds, OutOfMemoryLong,
                         testing::Values(std::pair("cpu", "Cloths"), std::pair("cpu", "Answers"),
                                         std::pair("cpu", "Exports"),
                                         std::pair("reference", "Saves"),
                                         std::pair("reference", "Models")),
                         NameOf);

TEST_P(OutOfMemory, EndsTheRequestAlone) {
  ExpectThatTheServerLives();
}

TEST_P(OutOfMemoryLong, EndsTheRequestAlone) {
  ExpectThatTheServerLives();
}

TEST(SmallMemory, DefaultsAreNoMoreThanTheProcessMayHave) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  EXPECT_NE(server.Log().find("memory bytes="), std::string::npos) << server.Log();
}

}  // namespace
}  // namespace drape::test
