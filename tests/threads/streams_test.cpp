// Many clients of one service at once, by every kind of stream.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <thread>
#include <vector>

#include "tests/threads/fake_server.h"

namespace drape::test {
namespace {

using std::chrono::milliseconds;
using Stub = v1::SimulationService::Stub;
using StepCall = grpc::ClientReaderWriter<v1::StepRequest, v1::StepResponse>;
using StateCall = grpc::ClientReaderWriter<v1::StreamStatesRequest, v1::StateChunk>;
using RunCall = grpc::ClientReaderWriter<v1::RunRequest, v1::RunReport>;

// Runs them all at once.
void AtOnce(const std::vector<std::function<void()>>& clients) {
  std::vector<std::thread> threads;
  for (const auto& client : clients) threads.emplace_back(client);
  for (std::thread& thread : threads) thread.join();
}

// A connection and a session with two cloths.
class Client {
 public:
  explicit Client(const FakeServer& server) : stub_(server.Connect()) {
    grpc::ClientContext context;
    v1::Session session;
    EXPECT_TRUE(stub_->CreateSession(&context, {}, &session).ok());
    session_ = session.name();
    v1::CreateClothsRequest request;
    request.set_session(session_);
    request.set_count(2);
    v1::Grid& grid = *request.mutable_spec()->mutable_grid();
    grid.set_columns(4);
    grid.set_rows(4);
    grid.set_width_m(1);
    grid.set_height_m(1);
    grpc::ClientContext creation;
    v1::CreateClothsResponse created;
    const grpc::Status status = stub_->CreateCloths(&creation, request, &created);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  Stub& stub() { return *stub_; }
  const std::string& session() const { return session_; }
  v1::StepRequest OneStep() const {
    v1::StepRequest request;
    request.set_session(session_);
    request.set_all_cloths(true);
    request.set_steps(1);
    request.mutable_view()->set_positions(true);
    return request;
  }
  grpc::Status Step(v1::StepResponse* answer) {
    grpc::ClientContext context;
    return stub_->Step(&context, OneStep(), answer);
  }
  void Delete() {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    request.set_name(session_);
    v1::DeleteSessionResponse answer;
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &answer).ok());
  }

 private:
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

class Streams : public testing::Test {
 protected:
  static constexpr int kSteps = 60;

  // Everything that calls hold comes back after their end, as soon as the server knows of it.
  ~Streams() override {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    const auto is_idle = [&] {
      return server_.unread_bytes() == 0 && server_.runs() == 0 &&
             server_.scheduler().counters().queued_requests == 0;
    };
    while (!is_idle() && std::chrono::steady_clock::now() < give_up) {
      std::this_thread::sleep_for(milliseconds(1));
    }
    EXPECT_EQ(server_.unread_bytes(), 0u);
    EXPECT_EQ(server_.runs(), 0u);
    EXPECT_EQ(server_.scheduler().counters().queued_requests, 0u);
    server_.Stop();
    EXPECT_EQ(server_.device().calls_on_wrong_thread(), 0u);
  }

  FakeServer server_;
};

// Writes and reads at the same time; vanishes after so many answers, or with 0 does not.
void StepByStream(Client& client, int steps, int vanishes_after) {
  grpc::ClientContext context;
  const std::unique_ptr<StepCall> call = client.stub().StepStream(&context);
  std::thread writer([&] {
    for (int k = 0; k < steps; ++k) {
      if (!call->Write(client.OneStep())) return;
    }
    call->WritesDone();
  });
  v1::StepResponse answer;
  int answers = 0;
  while (call->Read(&answer)) {
    ++answers;
    EXPECT_EQ(answer.states().steps(0), static_cast<uint64_t>(answers)) << "in order";
    if (answers == vanishes_after) context.TryCancel();
  }
  writer.join();
  const grpc::Status status = call->Finish();
  if (vanishes_after == 0) {
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(answers, steps);
  }
}

TEST_F(Streams, StepStreamsAnswerInOrderBesideOthersThatVanish) {
  std::vector<std::function<void()>> clients;
  for (int k = 0; k < 6; ++k) {
    clients.push_back([this, k] {
      Client client(server_);
      StepByStream(client, kSteps, k % 2 == 0 ? 0 : 5 * k);
    });
  }
  AtOnce(clients);
}

// Reads until the end, or vanishes after so many frames; the steps of its first cloth.
std::vector<uint64_t> View(Client& client, v1::StreamStatesRequest::Delivery delivery,
                           size_t frames) {
  grpc::ClientContext context;
  const std::unique_ptr<StateCall> call = client.stub().StreamStates(&context);
  v1::StreamStatesRequest request;
  request.mutable_subscribe()->set_session(client.session());
  request.mutable_subscribe()->set_all_cloths(true);
  request.mutable_subscribe()->mutable_view()->set_positions(true);
  request.mutable_subscribe()->set_delivery(delivery);
  const bool is_latest = delivery == v1::StreamStatesRequest::LATEST;
  if (is_latest) request.mutable_subscribe()->set_initial_credit(2);
  EXPECT_TRUE(call->Write(request));
  v1::StreamStatesRequest credit;
  credit.set_credit(1);
  std::vector<uint64_t> steps;
  v1::StateChunk chunk;
  while (call->Read(&chunk)) {
    if (chunk.cloth_ids_size() > 0) steps.push_back(chunk.steps(0));
    if (steps.size() == frames) context.TryCancel();
    if (is_latest) call->Write(credit);
  }
  call->Finish();
  return steps;
}

TEST_F(Streams, ViewersSeeWhatTheyAskForWhileOthersComeAndGo) {
  Client stepper(server_);
  std::atomic<bool> is_over{false};
  std::vector<std::function<void()>> clients = {[&] {
    v1::StepResponse answer;
    while (!is_over) EXPECT_TRUE(stepper.Step(&answer).ok());
  }};
  std::atomic<int> viewers{6};
  for (int k = 0; k < 6; ++k) {
    clients.push_back([&, k] {
      const bool is_every = k % 2 == 0;
      for (int visit = 0; visit < 3; ++visit) {
        const std::vector<uint64_t> steps = View(
            stepper,
            is_every ? v1::StreamStatesRequest::EVERY_FRAME : v1::StreamStatesRequest::LATEST, 30);
        EXPECT_EQ(steps.size(), 30u);
        for (size_t n = 1; n < steps.size(); ++n) {
          EXPECT_GT(steps[n], steps[n - 1]);
          EXPECT_TRUE(!is_every || steps[n] == steps[n - 1] + 1) << "none is missing";
        }
      }
      if (--viewers == 0) is_over = true;
    });
  }
  AtOnce(clients);
}

// Pauses now and then; the last report, if it did not vanish.
void RunBySelf(Client& client, bool vanishes) {
  grpc::ClientContext context;
  const std::unique_ptr<RunCall> call = client.stub().Run(&context);
  v1::RunRequest request;
  request.mutable_start()->set_session(client.session());
  request.mutable_start()->set_all_cloths(true);
  request.mutable_start()->set_steps_hz(500);
  request.mutable_start()->set_max_steps(100);
  request.mutable_start()->set_report_interval_s(0.01);
  EXPECT_TRUE(call->Write(request));
  v1::RunReport report, last;
  for (int reports = 0; call->Read(&report); ++reports) {
    EXPECT_GE(report.steps(), last.steps());
    last = report;
    if (reports == 3) {
      for (const bool is_paused : {true, false}) {
        v1::RunRequest pause;
        pause.set_pause(is_paused);
        call->Write(pause);
      }
    }
    if (vanishes && reports == 5) context.TryCancel();
  }
  const grpc::Status status = call->Finish();
  if (vanishes) return;
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(last.is_last());
  EXPECT_EQ(last.steps(), 100u);
}

TEST_F(Streams, RunsGoOnBesideOthersThatVanishAndAreWatched) {
  std::vector<std::function<void()>> clients;
  for (int k = 0; k < 4; ++k) {
    clients.push_back([this, k] {
      Client client(server_);
      std::thread viewer([&] { View(client, v1::StreamStatesRequest::LATEST, 5); });
      RunBySelf(client, k % 2 == 1);
      v1::StepResponse answer;
      // The viewer gets its frames.
      for (int step = 0; step < 20; ++step) EXPECT_TRUE(client.Step(&answer).ok());
      client.Delete();
      viewer.join();
    });
  }
  AtOnce(clients);
}

TEST_F(Streams, SessionsEndUnderTheirStreams) {
  std::vector<std::function<void()>> clients;
  for (int k = 0; k < 4; ++k) {
    clients.push_back([this] {
      Client client(server_);
      AtOnce({[&] {
                std::this_thread::sleep_for(milliseconds(30));
                client.Delete();
              },
              [&] { View(client, v1::StreamStatesRequest::EVERY_FRAME, SIZE_MAX); },
              [&] { RunBySelf(client, true); },
              [&] {
                v1::StepResponse answer;
                while (client.Step(&answer).ok()) continue;
              }});
    });
  }
  AtOnce(clients);
}

TEST_F(Streams, TheServerStopsUnderTheirStreams) {
  std::vector<std::unique_ptr<Client>> made;
  for (int k = 0; k < 4; ++k) made.push_back(std::make_unique<Client>(server_));
  std::vector<std::function<void()>> clients = {[&] {
    std::this_thread::sleep_for(milliseconds(50));
    server_.Stop();
  }};
  for (const auto& client : made) {
    clients.push_back([&] { View(*client, v1::StreamStatesRequest::EVERY_FRAME, SIZE_MAX); });
    clients.push_back([&] { RunBySelf(*client, true); });
    clients.push_back([&] {
      v1::StepResponse answer;
      while (client->Step(&answer).ok()) continue;
    });
  }
  AtOnce(clients);
}

}  // namespace
}  // namespace drape::test
