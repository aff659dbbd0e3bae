// What clients hold is counted: limits hold while they ask for more, and all returns when they go.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/metrics.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::HasSubstr;

// What a client holds of a server; each returns to zero when its sessions are gone.
const char* const kHeld[] = {
    "drape_sessions",     "drape_cloths",           "drape_particles",   "drape_queued_requests",
    "drape_unread_bytes", "drape_remembered_bytes", "drape_saved_bytes", "drape_queued_builds"};

// A session whose every request may be refused for want of room, never otherwise.
class RandomClient {
 public:
  RandomClient(std::unique_ptr<Stub> stub, uint32_t seed) : stub_(std::move(stub)), random_(seed) {
    session_ = NewSession(*stub_);
  }
  void Run(int requests) {
    for (int k = 0; k < requests; ++k) {
      const grpc::Status status = One(k);
      if (status.ok()) continue;
      ++refused_;
      EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
          << status.error_message();
    }
  }
  void Close() {
    v1::DeleteSessionRequest request;
    request.set_name(session_);
    EXPECT_TRUE(Call(*stub_, &Stub::DeleteSession, request).status.ok());
  }
  int refused() const { return refused_; }

 private:
  uint32_t Below(uint32_t count) { return static_cast<uint32_t>(random_() % count); }

  grpc::Status One(int number) {
    switch (ids_.empty() ? 0 : Below(6)) {
      case 0:
        return Create();
      case 1:
        return Delete();
      case 2:
        return Save();
      case 3: {
        v1::DropStatesRequest request;
        request.set_session(session_);
        request.set_name("other");  // whether there or not
        const grpc::Status status = Call(*stub_, &Stub::DropStates, request).status;
        return status.error_code() == grpc::StatusCode::NOT_FOUND ? grpc::Status() : status;
      }
      default: {
        v1::StepRequest request = StepsOf(session_, {}, 1 + Below(3));
        request.set_request_id(std::to_string(number));
        request.mutable_view();
        return Call(*stub_, &Stub::Step, request).status;
      }
    }
  }
  grpc::Status Create() {
    const auto answer =
        Call(*stub_, &Stub::CreateCloths, HangingSheet(session_, 3 + Below(10), 1 + Below(8)));
    for (const uint64_t id : answer.value.cloth_ids()) ids_.push_back(id);
    return answer.status;
  }
  grpc::Status Delete() {
    v1::DeleteClothsRequest request;
    request.set_session(session_);
    request.add_cloth_ids(ids_.back());
    ids_.pop_back();
    return Call(*stub_, &Stub::DeleteCloths, request).status;
  }
  grpc::Status Save() {
    v1::SaveStatesRequest request;
    request.set_session(session_);
    request.set_name(Below(2) == 0 ? "one" : "other");
    request.set_all_cloths(true);
    return Call(*stub_, &Stub::SaveStates, request).status;
  }

  std::unique_ptr<Stub> stub_;
  std::mt19937 random_;
  std::string session_;
  Ids ids_;
  int refused_ = 0;
};

TEST(Quotas, ReturnToZeroWhenClientsGo) {
  constexpr int kClients = 6, kRequests = 80;
  ServerProcess server({"--backend=cpu", "--metrics-listen=127.0.0.1:0",
                        "--max-cloths-per-session=24", "--max-saved-bytes=200000"});
  ASSERT_TRUE(server.WaitUntilUp());
  std::vector<RandomClient> clients;
  for (uint32_t c = 0; c < kClients; ++c) clients.emplace_back(server.NewStub(), 100 + c);
  std::vector<std::thread> threads;
  for (RandomClient& client : clients) threads.emplace_back([&] { client.Run(kRequests); });
  for (std::thread& thread : threads) thread.join();

  const std::string held = MetricsOf(server);
  EXPECT_EQ(MetricIn(held, "drape_sessions"), kClients);
  for (const char* name : {"drape_cloths", "drape_remembered_bytes", "drape_saved_bytes"}) {
    EXPECT_GT(MetricIn(held, name), 0) << name << ": nothing was held";
  }
  EXPECT_LE(MetricIn(held, "drape_saved_bytes"), 200000);
  int refused = 0;
  for (const RandomClient& client : clients) refused += client.refused();
  EXPECT_GT(refused, 0) << "no limit was met";

  for (RandomClient& client : clients) client.Close();
  for (const char* name : kHeld) {
    // What an answer held goes once gRPC has written it, after the client may have read it.
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (MetricIn(MetricsOf(server), name) != 0 && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_EQ(MetricIn(MetricsOf(server), name), 0) << name;
  }
}

TEST(Quotas, SavedBytesHaveALimit) {
  ServerProcess server({"--backend=cpu", "--max-saved-bytes=40000"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  Create(*stub, HangingSheet(session, 8));
  v1::SaveStatesRequest request;
  request.set_session(session);
  request.set_all_cloths(true);
  request.set_name("0");
  const auto first = Call(*stub, &Stub::SaveStates, request);
  ASSERT_TRUE(first.status.ok()) << first.status.error_message();
  // One session may have a quarter.
  ASSERT_LT(first.value.bytes(), 10000u) << "one of them is too large for this test";
  grpc::Status status;
  uint64_t kept = 0;
  for (int k = 0; k < 100 && status.ok(); ++k, kept += status.ok() ? first.value.bytes() : 0) {
    request.set_name(std::to_string(k));
    status = Call(*stub, &Stub::SaveStates, request).status;
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("max_saved_bytes"));
  EXPECT_LE(kept, 10000u);
  v1::DropStatesRequest drop;
  drop.set_session(session);
  drop.set_name("0");
  EXPECT_TRUE(Call(*stub, &Stub::DropStates, drop).status.ok());
  EXPECT_TRUE(Call(*stub, &Stub::SaveStates, request).status.ok()) << "room was made";
}

// A few bytes ask for a million of them, before anything is made.
TEST(Quotas, CollidersOfACreationUnderWayCount) {
  ServerProcess server({"--backend=cpu", "--max-unread-bytes=16777216"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  v1::CreateClothsRequest request = HangingSheet(NewSession(*stub), 2, 1024);
  for (int k = 0; k < 256; ++k) {
    auto* sphere = request.mutable_spec()->mutable_environment()->add_colliders()->mutable_sphere();
    for (const double x : {0.0, -5.0, 0.0}) sphere->add_center_m(x);
    sphere->set_radius_m(1);
  }
  const auto created = Call(*stub, &Stub::CreateCloths, request);
  EXPECT_EQ(created.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(created.status.error_message(), HasSubstr("max_unread_bytes"));
  request.set_count(16);
  EXPECT_TRUE(Call(*stub, &Stub::CreateCloths, request).status.ok());
}

// Numbers in double precision, until the device has taken them, beside the request itself.
TEST(Quotas, WrittenStatesUnderWayCount) {
  ServerProcess server({"--backend=cpu", "--max-unread-bytes=16777216"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  v1::WriteStatesRequest request;
  request.set_session(NewSession(*stub));
  const Ids ids = Create(*stub, HangingSheet(request.session(), 256, 8));
  const auto write = [&](uint32_t count) {
    request.clear_cloth_ids();
    for (uint32_t k = 0; k < count; ++k) request.add_cloth_ids(ids[k]);
    v1::PackedArray& positions = *request.mutable_positions_m();
    positions.Clear();
    positions.set_data_type(v1::PackedArray::FLOAT32);
    positions.add_shape(65536 * count);
    positions.add_shape(3);
    positions.set_data(std::string(size_t{65536} * count * 3 * sizeof(float), 0));
    return Call(*stub, &Stub::WriteStates, request).status;
  };
  const grpc::Status status = write(8);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("max_unread_bytes"));
  const grpc::Status one = write(1);
  EXPECT_TRUE(one.ok()) << one.error_message();
}

// One small request drives every length of many cloths, which each get theirs.
TEST(Quotas, DrivenRestLengthsAreCounted) {
  ServerProcess server({"--backend=cpu", "--max-model-bytes=2000000"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 20, 64));
  const auto scaled = [&](const Ids& cloths) {
    v1::StepRequest request = StepsOf(session, cloths, 1);
    for (const uint64_t id : cloths) {
      request.mutable_rest_length_scales()->add_cloth_ids(id);
      request.mutable_rest_length_scales()->add_scales(0.9);
    }
    return Call(*stub, &Stub::Step, request).status;
  };
  const grpc::Status status = scaled(ids);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("max_model_bytes"));
  EXPECT_TRUE(scaled({ids[0], ids[1]}).ok()) << "none of the others counts";
}

}  // namespace
}  // namespace drape::test
