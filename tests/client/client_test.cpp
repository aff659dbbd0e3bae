// The library against a private server: life of servers and sessions, every request, typed errors.
#include "drape/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "client/src/private_server.h"
#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::ProgramPath;
using client_test::TemporaryFolder;
using client_test::WriteText;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
namespace fs = std::filesystem;

SpawnOptions CpuServer() {
  SpawnOptions options;
  options.backend = "cpu";
  options.executable = ProgramPath("draped");
  return options;
}

v1::ClothSpec SmallCloth() {
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(4);
  spec.mutable_grid()->set_rows(3);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  spec.add_pins()->set_particle(0);
  return spec;
}

class ClientTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { client_ = new Client(Client::SpawnServer(CpuServer())); }
  static void TearDownTestSuite() {
    delete client_;
    client_ = nullptr;
  }
  static Client* client_;
};

Client* ClientTest::client_ = nullptr;

TEST_F(ClientTest, TellsAboutTheServer) {
  const v1::ServerInfo info = client_->GetServerInfo();
  EXPECT_EQ(info.backend(), "cpu");
  EXPECT_EQ(info.precision(), "float32");
  EXPECT_GT(info.limits().max_steps_per_request(), 0u);
  EXPECT_EQ(client_->CheckHealth(), Health::kServing);
  EXPECT_EQ(ErrorOf([] { client_->CheckHealth("no.such.Service"); }).code, ErrorCode::kNotFound);
}

TEST_F(ClientTest, CreatesStepsAndReads) {
  Session session = client_->CreateSession();
  const std::vector<ClothId> ids = session.CreateCloths(SmallCloth(), 3);
  ASSERT_THAT(ids, SizeIs(3));
  EXPECT_EQ(session.GetCloth(ids[1]).shape().particles(), 12u);
  const v1::StepResponse response = session.Step(2);
  EXPECT_THAT(response.steps(), ElementsAre(2u, 2u, 2u));

  v1::StateView view;
  view.set_positions(true);
  view.set_velocities(true);
  const States all = session.ReadStates(view);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[2].cloth_id, ids[2]);
  EXPECT_EQ(all[0].positions_m.row_count(), 12u);
  EXPECT_EQ(all[0].velocities_m_per_s.row_count(), 12u);
  EXPECT_FALSE(all[0].positions_m.is_float64());
  EXPECT_LT(all[0].positions_m.At(11, 1), 0) << "it falls";
  EXPECT_EQ(all[0].positions_m.At(0, 1), 0) << "but for its pin";
  const States one = session.ReadStates({&ids[1], 1});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_TRUE(one[0].velocities_m_per_s.empty());

  view.add_particles(2);
  view.add_particles(11);
  const States some = session.ReadStates(view);
  ASSERT_EQ(some.size(), 3u);
  EXPECT_EQ(some[1].particle_count, 2u);
  EXPECT_EQ(some[1].positions_m.row_count(), 2u);
  EXPECT_EQ(some[1].positions_m.At(0, 0), all[1].positions_m.At(2, 0));
  EXPECT_EQ(some[1].velocities_m_per_s.At(1, 1), all[1].velocities_m_per_s.At(11, 1));
  view.add_particles(12);
  const ErrorDetails refused = ErrorOf([&] { session.ReadStates(view); });
  ASSERT_THAT(refused.violations, SizeIs(1));
  EXPECT_EQ(refused.violations[0].field, "view.particles[2]");

  session.ResetCloths({&ids[1], 1});
  EXPECT_EQ(session.GetCloth(ids[1]).step(), 0u);
  EXPECT_EQ(session.GetCloth(ids[0]).step(), 2u);
  const ErrorDetails none = ErrorOf([&] { session.ResetCloths(std::vector<ClothId>()); });
  EXPECT_EQ(none.violations.at(0).field, "cloth_ids");
  EXPECT_EQ(session.GetCloth(ids[0]).step(), 2u);
  session.ResetCloths();
  EXPECT_EQ(session.GetCloth(ids[0]).step(), 0u);
}

// 300 x 300 particles with velocities are 2.2 MB.
TEST_F(ClientTest, LargeAnswersComeInChunksAndStayThere) {
  Session session = client_->CreateSession();
  v1::ClothSpec spec = SmallCloth();
  spec.mutable_grid()->set_columns(300);
  spec.mutable_grid()->set_rows(300);
  spec.mutable_settings()->set_substeps(1);
  session.CreateCloth(SmallCloth());
  session.CreateCloth(spec);
  v1::StepRequest request;
  request.set_all_cloths(true);
  request.set_steps(2);
  request.set_report(true);
  request.mutable_view()->set_positions(true);
  request.mutable_view()->set_velocities(true);
  const auto expect_present = [&](const SteppedStates& stepped, uint64_t step) {
    EXPECT_THAT(stepped.answer.steps(), ElementsAre(step, step));
    EXPECT_THAT(stepped.answer.reports(), SizeIs(2));
    EXPECT_FALSE(stepped.answer.has_states());
    EXPECT_FALSE(stepped.answer.continues());
    const States states = session.ReadStates(request.view());
    ASSERT_EQ(stepped.states.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
      const auto floats = stepped.states[k].positions_m.floats();
      EXPECT_EQ(stepped.states[k].step, step);
      EXPECT_EQ(floats.size(), k == 0 ? 36u : 270'000u);
      EXPECT_TRUE(std::ranges::equal(floats, states[k].positions_m.floats()));
      EXPECT_TRUE(std::ranges::equal(stepped.states[k].velocities_m_per_s.floats(),
                                     states[k].velocities_m_per_s.floats()));
    }
  };
  expect_present(session.StepStates(request), 2);
  StepStream stream = session.OpenStepStream();
  request.set_in_chunks(true);
  stream.Write(request);
  const std::optional<SteppedStates> stepped = stream.ReadStates();
  ASSERT_TRUE(stepped.has_value());
  expect_present(*stepped, 4);
  request.set_expected_step(3);
  EXPECT_EQ(ErrorOf([&] { session.StepStates(request); }).reason, "STEP_MISMATCH");
  stream.FinishWriting();
  EXPECT_FALSE(stream.ReadStates().has_value());
}

TEST_F(ClientTest, ChangesListsAndDeletes) {
  Session session = client_->CreateSession();
  const std::vector<ClothId> ids = session.CreateCloths(SmallCloth(), 2);
  v1::ClothSpec change;
  for (const double g : {0.0, 0.0, 3.0}) change.mutable_environment()->add_gravity_m_per_s2(g);
  const std::string path = "environment.gravity_m_per_s2";
  session.UpdateCloths({&ids[0], 1}, change, {&path, 1});
  EXPECT_THAT(session.GetCloth(ids[0]).environment().gravity_m_per_s2(), ElementsAre(0, 0, 3));
  EXPECT_THAT(session.GetCloth(ids[1]).environment().gravity_m_per_s2(), ElementsAre(0, -9.81, 0));
  EXPECT_THAT(session.ListCloths(), SizeIs(2));
  session.DeleteCloths({&ids[0], 1});
  const std::vector<v1::Cloth> left = session.ListCloths();
  ASSERT_THAT(left, SizeIs(1));
  EXPECT_EQ(left[0].id(), ids[1]);
}

// More than a page of 1000.
TEST_F(ClientTest, ListsEveryPage) {
  Session session = client_->CreateSession();
  v1::ClothSpec spec;
  for (int k = 0; k < 3; ++k) spec.mutable_particles()->add_positions_m(k);
  spec.mutable_particles()->add_masses_kg(1);
  const std::vector<ClothId> ids = session.CreateCloths(spec, 1500);
  const std::vector<v1::Cloth> cloths = session.ListCloths();
  ASSERT_EQ(cloths.size(), ids.size());
  for (size_t k = 0; k < ids.size(); ++k) EXPECT_EQ(cloths[k].id(), ids[k]);
  EXPECT_EQ(session.ReadStates().size(), 1500u);
}

TEST_F(ClientTest, ErrorsCarryReasonAndFields) {
  Session session = client_->CreateSession();
  v1::ClothSpec spec = SmallCloth();
  spec.mutable_pins(0)->set_particle(99);
  const ErrorDetails details = ErrorOf([&] { session.CreateCloth(spec); });
  EXPECT_EQ(details.code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(details.domain, "drape");
  EXPECT_FALSE(details.reason.empty());
  ASSERT_FALSE(details.violations.empty());
  EXPECT_THAT(details.violations[0].field, HasSubstr("pins[0].particle"));
  EXPECT_EQ(ErrorOf([&] { session.GetCloth(12345); }).code, ErrorCode::kNotFound);
  EXPECT_EQ(ErrorOf([] { client_->AttachSession("sessions/none-0"); }).code, ErrorCode::kNotFound);
}

TEST_F(ClientTest, ASessionGoesWithItsObjectUnlessDetached) {
  std::string gone;
  std::string kept;
  {
    const Session session = client_->CreateSession();
    gone = session.name();
    Session detached = client_->CreateSession();
    detached.Detach();
    kept = detached.name();
    // An attached session is never deleted with its object.
    const Session attached = client_->AttachSession(kept);
  }
  EXPECT_EQ(ErrorOf([&] { client_->AttachSession(gone); }).code, ErrorCode::kNotFound);
  Session attached = client_->AttachSession(kept);
  attached.Delete();
  EXPECT_EQ(ErrorOf([&] { attached.Step(1); }).code, ErrorCode::kNotFound);
}

TEST_F(ClientTest, TheLeaseIsRenewedInTheBackground) {
  SessionOptions short_lease;
  short_lease.ttl_s = 1;
  Session renewed = client_->CreateSession(short_lease);
  short_lease.renews_lease = false;
  Session left = client_->CreateSession(short_lease);
  // Longer than the lease and the server's longest wait between two looks (1 s).
  std::this_thread::sleep_for(std::chrono::milliseconds(2600));
  EXPECT_EQ(ErrorOf([&] { left.Renew(); }).code, ErrorCode::kNotFound);
  EXPECT_FALSE(renewed.lease_error().has_value());
  EXPECT_EQ(renewed.Renew().ttl_s(), 1);
}

TEST_F(ClientTest, TellsWhenTheSessionIsGone) {
  SessionOptions options;
  options.ttl_s = 1;
  Session session = client_->CreateSession(options);
  client_->AttachSession(session.name()).Delete();
  for (int tries = 0; tries < 100 && !session.lease_error(); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ASSERT_TRUE(session.lease_error().has_value());
  EXPECT_EQ(session.lease_error()->code(), ErrorCode::kNotFound);
}

TEST_F(ClientTest, AStepStreamAnswersInOrder) {
  Session session = client_->CreateSession();
  session.CreateCloth(SmallCloth());
  StepStream stream = session.OpenStepStream();
  for (uint32_t steps = 1; steps <= 4; ++steps) {
    v1::StepRequest request;
    request.set_all_cloths(true);
    request.set_steps(steps);
    stream.Write(request);
  }
  stream.FinishWriting();
  std::vector<uint64_t> completed;
  while (const auto response = stream.Read()) completed.push_back(response->steps(0));
  EXPECT_THAT(completed, ElementsAre(1u, 3u, 6u, 10u));
}

TEST_F(ClientTest, AStepStreamEndsWithItsError) {
  Session session = client_->CreateSession();
  session.CreateCloth(SmallCloth());
  StepStream stream = session.OpenStepStream();
  stream.Write(v1::StepRequest());  // neither steps nor until_step
  EXPECT_EQ(ErrorOf([&] {
              while (stream.Read()) {
              }
            }).code,
            ErrorCode::kInvalidArgument);
}

TEST_F(ClientTest, AStateStreamFollows) {
  Session session = client_->CreateSession();
  session.CreateCloths(SmallCloth(), 2);
  v1::StreamStatesRequest::Subscribe subscribe;
  subscribe.set_all_cloths(true);
  StateStream stream = session.StreamStates(std::move(subscribe));
  std::thread stepper([&session] {
    for (int k = 0; k < 20; ++k) {
      session.Step(1);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  uint64_t last_frame = 0;
  uint64_t last_step = 0;
  while (last_step < 20) {
    const std::optional<States> frame = stream.Next();
    ASSERT_TRUE(frame.has_value());
    ASSERT_EQ(frame->size(), 2u);
    EXPECT_GT(frame->frame(), last_frame);
    EXPECT_GE((*frame)[0].step, last_step);
    last_frame = frame->frame();
    last_step = (*frame)[0].step;
  }
  stepper.join();
  stream.Cancel();
  EXPECT_EQ(ErrorOf([&] {
              while (stream.Next()) {
              }
            }).code,
            ErrorCode::kCancelled);
}

// The server steps; every step of it arrives.
TEST_F(ClientTest, ARunIsFollowedStepByStep) {
  Session session = client_->CreateSession();
  session.CreateCloth(SmallCloth());
  v1::StreamStatesRequest::Subscribe subscribe;
  subscribe.set_all_cloths(true);
  subscribe.set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
  StateStream frames = session.StreamStates(std::move(subscribe));
  EXPECT_EQ((*frames.Next())[0].step, 0u);
  v1::RunRequest::Start start;
  start.set_steps_hz(500);
  RunStream run = session.Run(start);
  EXPECT_EQ(run.Next()->steps(), 0u) << "it has begun";
  for (uint64_t step = 1; step <= 20; ++step) EXPECT_EQ((*frames.Next())[0].step, step);
  run.SetPaused(true);
  while (!run.Next()->is_paused()) {
  }
  run.Stop();
  v1::RunReport last;
  while (const auto report = run.Next()) last = *report;
  EXPECT_TRUE(last.is_last());
  EXPECT_GE(last.steps(), 20u);
  EXPECT_EQ(session.GetCloth(session.ListCloths()[0].id()).step(), last.steps());
}

TEST_F(ClientTest, ARunThatIsRefusedSaysWhy) {
  Session session = client_->CreateSession();
  session.CreateCloth(SmallCloth());
  v1::RunRequest::Start start;
  start.set_expected_step(7);
  const ErrorDetails details = ErrorOf([&] {
    RunStream run = session.Run(start);
    while (run.Next()) {
    }
  });
  EXPECT_EQ(details.reason, "STEP_MISMATCH");
  EXPECT_EQ(details.metadata.at("steps"), "0");
}

TEST(ConnectTest, SaysWhereNobodyAnswers) {
  ConnectOptions options;
  options.ready_timeout_s = 0.3;
  const ErrorDetails details = ErrorOf([&] { Client::Connect("127.0.0.1:1", options); });
  EXPECT_EQ(details.code, ErrorCode::kUnavailable);
  EXPECT_EQ(details.reason, "CANNOT_CONNECT");
  EXPECT_THAT(details.message, HasSubstr("127.0.0.1:1"));
}

TEST(PrivateServerTest, ListensAndStopsWithItsObject) {
  pid_t pid = 0;
  {
    const PrivateServer server(CpuServer());
    pid = server.pid();
    EXPECT_THAT(server.address(), HasSubstr("127.0.0.1:"));
    EXPECT_EQ(kill(pid, 0), 0);
    EXPECT_EQ(getpgid(pid), pid) << "a group of its own";
  }
  EXPECT_EQ(kill(pid, 0), -1);
}

TEST(PrivateServerTest, ShowsTheLogOfAServerThatDies) {
  const TemporaryFolder folder;
  WriteText(folder / "bad", "#!/bin/sh\necho 'no device here' >&2\nexit 3\n");
  fs::permissions(folder / "bad", fs::perms::owner_all);
  SpawnOptions options;
  options.executable = folder / "bad";
  const ErrorDetails details = ErrorOf([&] { PrivateServer{options}; });
  EXPECT_EQ(details.reason, "SERVER_ENDED");
  EXPECT_THAT(details.message, HasSubstr("status 3"));
  EXPECT_THAT(details.message, HasSubstr("no device here"));
}

TEST(PrivateServerTest, GivesUpOnAServerThatSaysNothing) {
  const TemporaryFolder folder;
  WriteText(folder / "mute", "#!/bin/sh\nexec sleep 60\n");
  fs::permissions(folder / "mute", fs::perms::owner_all);
  SpawnOptions options;
  options.executable = folder / "mute";
  options.ready_timeout_s = 0.3;
  EXPECT_EQ(ErrorOf([&] { PrivateServer{options}; }).reason, "SERVER_NOT_READY");
}

TEST(FindServerProgramTest, LooksWhereItSays) {
  EXPECT_EQ(FindServerProgram(""), ProgramPath("draped")) << "beside the executable";
  const TemporaryFolder folder;
  WriteText(folder / "mine", "#!/bin/sh\n");
  EXPECT_EQ(ErrorOf([&] { FindServerProgram(folder / "mine"); }).reason, "NO_SERVER_PROGRAM")
      << "not executable";
  fs::permissions(folder / "mine", fs::perms::owner_all);
  EXPECT_EQ(FindServerProgram(folder / "mine"), folder / "mine");
  setenv("DRAPE_SERVER", (folder / "mine").c_str(), 1);
  EXPECT_EQ(FindServerProgram(""), folder / "mine");
  EXPECT_EQ(FindServerProgram(ProgramPath("draped")), ProgramPath("draped"));
  unsetenv("DRAPE_SERVER");
}

}  // namespace
}  // namespace drape
