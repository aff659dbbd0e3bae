// The library against a service made up here: a server that hangs, large answers, what is sent.
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "drape/client.h"
#include "drape/v1/simulation_service.grpc.pb.h"

namespace drape {
namespace {

using std::chrono::seconds;

constexpr size_t kLargeBytes = 65 * 1024 * 1024;

// One session, whose renewals are answered once they are let go.
class MadeUpService final : public v1::SimulationService::Service {
 public:
  grpc::Status CreateSession(grpc::ServerContext*, const v1::CreateSessionRequest* request,
                             v1::Session* session) override {
    const std::lock_guard lock(mutex_);
    created_ = *request;
    session->set_name("sessions/made-up");
    session->set_ttl_s(1);
    return grpc::Status::OK;
  }

  grpc::Status RenewSession(grpc::ServerContext*, const v1::RenewSessionRequest*,
                            v1::Session*) override {
    std::unique_lock lock(mutex_);
    ++renewals_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return answers_renewals_; });
    return grpc::Status::OK;
  }

  grpc::Status DeleteSession(grpc::ServerContext*, const v1::DeleteSessionRequest*,
                             v1::DeleteSessionResponse*) override {
    return grpc::Status::OK;
  }

  // The first `refused` ones are not answered.
  grpc::Status GetSession(grpc::ServerContext*, const v1::GetSessionRequest*,
                          v1::Session* session) override {
    const std::lock_guard lock(mutex_);
    if (++looks_ <= refused_) return {grpc::StatusCode::UNAVAILABLE, "not now"};
    session->set_name("sessions/made-up");
    session->set_ttl_s(1);
    return grpc::Status::OK;
  }

  grpc::Status GetServerInfo(grpc::ServerContext*, const v1::GetServerInfoRequest*,
                             v1::ServerInfo* info) override {
    info->set_device(std::string(kLargeBytes, 'x'));
    return grpc::Status::OK;
  }

  v1::CreateSessionRequest created() {
    const std::lock_guard lock(mutex_);
    return created_;
  }

  void RefuseLooks(int count) {
    const std::lock_guard lock(mutex_);
    refused_ = looks_ + count;
  }
  int looks() {
    const std::lock_guard lock(mutex_);
    return looks_;
  }

  bool WaitForRenewals(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(10), [&] { return renewals_ >= count; });
  }

  void AnswerRenewals() {
    {
      const std::lock_guard lock(mutex_);
      answers_renewals_ = true;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  v1::CreateSessionRequest created_;
  int looks_ = 0;
  int refused_ = 0;
  int renewals_ = 0;
  bool answers_renewals_ = false;
};

class ConnectionTest : public ::testing::Test {
 protected:
  ConnectionTest() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    client_.emplace(Client::Connect("127.0.0.1:" + std::to_string(port)));
  }
  ~ConnectionTest() override {
    service_.AnswerRenewals();
    server_->Shutdown();
  }

  MadeUpService service_;
  std::unique_ptr<grpc::Server> server_;
  std::optional<Client> client_;
};

TEST_F(ConnectionTest, RenewalsThatHangAreRepeatedAndDoNotHoldUpTheEnd) {
  auto session = std::make_unique<Session>(client_->CreateSession());
  EXPECT_TRUE(service_.WaitForRenewals(2));
  EXPECT_FALSE(session->lease_error().has_value());
  std::future<void> end = std::async(std::launch::async, [&session] { session.reset(); });
  EXPECT_EQ(end.wait_for(seconds(10)), std::future_status::ready);
  service_.AnswerRenewals();
}

TEST_F(ConnectionTest, TheServerBoundsItsAnswers) {
  EXPECT_EQ(client_->GetServerInfo().device().size(), kLargeBytes);
}

TEST_F(ConnectionTest, ARequestIsSentAgainWithinItsTries) {
  ConnectOptions options;
  options.retries.max_tries = 3;
  options.retries.first_pause_s = 0.001;
  const Client client = Client::Connect(client_->address(), options);
  service_.RefuseLooks(2);
  EXPECT_NO_THROW((void)client.AttachSession("sessions/made-up"));
  EXPECT_EQ(service_.looks(), 3);
  service_.RefuseLooks(3);
  try {
    (void)client.AttachSession("sessions/made-up");
    FAIL() << "it was sent four times";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUnavailable);
    EXPECT_EQ(error.details().unanswered_tries, 0u) << "a look changes nothing";
  }
  EXPECT_EQ(service_.looks(), 6);
}

// A pause that does not fit into the time of the request is not begun.
TEST_F(ConnectionTest, TheLimitOfTheRequestHoldsForAllItsTries) {
  ConnectOptions options;
  options.request_timeout_s = 60;
  options.retries.first_pause_s = 600;
  options.retries.max_pause_s = 600;
  const Client client = Client::Connect(client_->address(), options);
  service_.RefuseLooks(1);
  EXPECT_THROW((void)client.AttachSession("sessions/made-up"), Error);
  EXPECT_EQ(service_.looks(), 1);
}

TEST_F(ConnectionTest, ServersThatAreAwayAreAskedAFewTimesMore) {
  ConnectOptions options;
  options.retries.first_pause_s = options.retries.max_pause_s = 0.001;
  const Client client = Client::Connect(client_->address(), options);
  service_.RefuseLooks(1'000'000);
  for (int k = 0; k < 60; ++k) EXPECT_THROW((void)client.AttachSession("s"), Error);
  // 9 failures leave more than half of a budget of 20; the sixth one was the last of its request.
  EXPECT_EQ(service_.looks(), 60 + 8);
}

TEST_F(ConnectionTest, AProxyIsNotAskedForThisMachine) {
  setenv("http_proxy", "http://127.0.0.1:1", /*overwrite=*/1);
  ConnectOptions options;
  options.ready_timeout_s = 5;
  EXPECT_NO_THROW(Client::Connect(client_->address(), options));
  unsetenv("http_proxy");
}

TEST_F(ConnectionTest, TheLeaseIsTheServersUnlessChosen) {
  SessionOptions options;
  options.renews_lease = false;
  { const Session session = client_->CreateSession(options); }
  EXPECT_FALSE(service_.created().has_ttl_s());
  options.ttl_s = 20;
  { const Session session = client_->CreateSession(options); }
  EXPECT_EQ(service_.created().ttl_s(), 20);
}

}  // namespace
}  // namespace drape
