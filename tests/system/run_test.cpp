// Run: the server steps by itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <optional>
#include <thread>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/metrics.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using std::chrono::milliseconds;
using Start = v1::RunRequest::Start;

class Running {
 public:
  Running(Stub& stub, const Start& start) : stream_(stub.Run(&context_)) {
    v1::RunRequest request;
    *request.mutable_start() = start;
    EXPECT_TRUE(stream_->Write(request));
  }
  ~Running() { context_.TryCancel(); }

  // None: the run is over.
  std::optional<v1::RunReport> Next() {
    v1::RunReport report;
    if (!stream_->Read(&report)) return std::nullopt;
    return report;
  }
  // The first report that `is_wanted`; the last one if there is none.
  template <class Wanted>
  v1::RunReport NextWhere(Wanted is_wanted) {
    v1::RunReport last;
    while (const auto report = Next()) {
      last = *report;
      if (is_wanted(last)) return last;
    }
    ADD_FAILURE() << "no such report: " << last.ShortDebugString();
    return last;
  }
  void SetPaused(bool is_paused) {
    v1::RunRequest request;
    request.set_pause(is_paused);
    stream_->Write(request);
  }
  void Stop() { stream_->WritesDone(); }
  void Vanish() { context_.TryCancel(); }
  // Reads what is left.
  v1::RunReport LastReport() {
    v1::RunReport last;
    while (const auto report = Next()) last = *report;
    return last;
  }
  grpc::Status End() {
    while (Next()) continue;
    return stream_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::RunRequest, v1::RunReport>> stream_;
};

class Runs : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    stub_ = server_.NewStub();
    session_ = NewSession(*stub_);
  }

  Start Everything() const {
    Start start;
    start.set_session(session_);
    start.set_all_cloths(true);
    start.set_report_interval_s(0.01);
    return start;
  }
  uint64_t StepOf(uint64_t id) const { return Get(*stub_, session_, id).step(); }

  ServerProcess server_{{"--metrics-listen=127.0.0.1:0"}};
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

// The steps that were due by then: one at the beginning, then one per interval.
uint64_t DueBy(const v1::RunReport& report, double interval_s) {
  // elapsed_s is in whole microseconds.
  const double elapsed_us = std::round(report.elapsed_s() * 1e6);
  return static_cast<uint64_t>(std::floor(elapsed_us / (1e6 * interval_s))) + 1;
}

// However loaded the machine is, a report accounts for each step that was due.
TEST_F(Runs, RealTimeIsOneStepPerTimeStepAndEveryOneIsAccountedFor) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  const double time_step_s = Get(*stub_, session_, ids[0]).settings().time_step_s();
  Running run(*stub_, Everything());
  int reports = 0;
  const v1::RunReport report = run.NextWhere([&](const v1::RunReport& r) {
    ++reports;
    EXPECT_EQ(r.steps() + r.steps_behind() + r.steps_dropped(), DueBy(r, time_step_s));
    EXPECT_EQ(r.cloths(), 1u);
    return r.elapsed_s() > 1;
  });
  EXPECT_GT(report.steps(), 0u);
  EXPECT_GT(reports, 2);
  run.Stop();
  const v1::RunReport last = run.LastReport();
  EXPECT_TRUE(last.is_last());
  EXPECT_EQ(last.steps_behind(), 0u);
  EXPECT_TRUE(run.End().ok());
  EXPECT_EQ(StepOf(ids[0]), last.steps());
  EXPECT_EQ(last.lowest_step(), last.steps());
}

TEST_F(Runs, EndsAfterItsStepsWithTheBitsOfStep) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 2));
  Start start = Everything();
  start.clear_all_cloths();
  start.add_cloth_ids(ids[0]);
  start.set_unpaced(true);
  start.set_max_steps(100);
  Running run(*stub_, start);
  const v1::RunReport last = run.LastReport();
  EXPECT_TRUE(run.End().ok());
  EXPECT_TRUE(last.is_last());
  EXPECT_EQ(last.steps(), 100u);
  EXPECT_EQ(last.highest_step(), 100u);
  Step(*stub_, StepsOf(session_, {ids[1]}, 100));
  EXPECT_EQ(Bits(*stub_, session_, {ids[0]}), Bits(*stub_, session_, {ids[1]}));
}

TEST_F(Runs, LateStepsAreDroppedAndToldSo) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 32));
  Start start = Everything();
  start.set_steps_hz(1e6);  // no machine makes them
  start.set_max_behind_s(0.02);
  Running run(*stub_, start);
  const v1::RunReport report = run.NextWhere([](const auto& r) { return r.steps_dropped() > 0; });
  // What is due within 0.02 s may wait, and two are under way.
  EXPECT_LE(report.steps_behind(), 20'000u + 1 + 2);
  EXPECT_EQ(report.steps() + report.steps_behind() + report.steps_dropped(),
            DueBy(report, 1 / 1e6));
  run.Stop();
  const v1::RunReport last = run.LastReport();
  EXPECT_EQ(last.lowest_step(), StepOf(ids[0]));
  EXPECT_GT(MetricIn(MetricsOf(server_), "drape_run_steps_dropped_total"), 0);
}

TEST_F(Runs, APauseHoldsTheClothsAndTheTimeOfTheRun) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Start start = Everything();
  start.set_steps_hz(200);
  Running run(*stub_, start);
  run.NextWhere([](const auto& r) { return r.steps() > 3; });
  run.SetPaused(true);
  run.NextWhere([](const auto& r) { return r.is_paused(); });
  // Comes after what the run has under way.
  const uint64_t step = Step(*stub_, StepsOf(session_, ids, 1)).steps(0);
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(StepOf(ids[0]), step);
  run.SetPaused(false);
  const v1::RunReport on = run.NextWhere([&](const auto& r) { return r.lowest_step() > step; });
  EXPECT_FALSE(on.is_paused());
  EXPECT_EQ(on.steps() + on.steps_behind() + on.steps_dropped(), DueBy(on, 1 / 200.0))
      << "nothing was due in the pause";
}

TEST_F(Runs, EndWithTheirClient) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Start start = Everything();
  start.set_unpaced(true);
  Running run(*stub_, start);
  run.NextWhere([](const auto& r) { return r.steps() > 3; });
  EXPECT_EQ(MetricIn(MetricsOf(server_), "drape_runs"), 1);
  run.Vanish();
  EXPECT_EQ(run.End().error_code(), grpc::StatusCode::CANCELLED);
  // Until the server knows; 20 s are a generous limit.
  for (int k = 0; k < 2000 && MetricIn(MetricsOf(server_), "drape_runs") > 0; ++k) {
    std::this_thread::sleep_for(milliseconds(10));
  }
  ASSERT_EQ(MetricIn(MetricsOf(server_), "drape_runs"), 0);
  const uint64_t step = StepOf(ids[0]);
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(StepOf(ids[0]), step);
}

// The steps of a run and those of other requests take turns: each is made once.
TEST_F(Runs, OthersStepTheSameClothsBetweenTheirSteps) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Start start = Everything();
  start.set_steps_hz(1000);
  start.set_max_steps(50);
  Running first(*stub_, start);
  start.clear_steps_hz();
  start.set_unpaced(true);
  Running second(*stub_, start);
  for (int k = 0; k < 20; ++k) Step(*stub_, StepsOf(session_, ids, 2));
  EXPECT_TRUE(first.End().ok());
  EXPECT_TRUE(second.End().ok());
  EXPECT_EQ(StepOf(ids[0]), 50u + 50u + 40u);
}

TEST_F(Runs, GoOnWhereTheFormerOneEnded) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Start start = Everything();
  start.set_unpaced(true);
  start.set_max_steps(10);
  start.set_expected_step(0);
  EXPECT_TRUE(Running(*stub_, start).End().ok());
  const grpc::Status again = Running(*stub_, start).End();
  EXPECT_EQ(again.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ReasonOf(again), "STEP_MISMATCH");
  EXPECT_EQ(StepOf(ids[0]), 10u) << "nothing has moved";
  start.set_expected_step(10);
  EXPECT_TRUE(Running(*stub_, start).End().ok());
  EXPECT_EQ(StepOf(ids[0]), 20u);
}

TEST_F(Runs, GoOnWithTheClothsThatAreLeft) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 3));
  Start start = Everything();
  start.set_unpaced(true);
  Running run(*stub_, start);
  run.NextWhere([](const auto& r) { return r.steps() > 3 && r.cloths() == 3; });
  v1::DeleteClothsRequest gone;
  gone.set_session(session_);
  gone.add_cloth_ids(ids[1]);
  ASSERT_TRUE(Call(*stub_, &Stub::DeleteCloths, gone).status.ok());
  const v1::RunReport less = run.NextWhere([](const auto& r) { return r.cloths() == 2; });
  run.NextWhere([&](const auto& r) { return r.steps() > less.steps() + 3; });
  gone.set_cloth_ids(0, ids[0]);
  gone.add_cloth_ids(ids[2]);
  ASSERT_TRUE(Call(*stub_, &Stub::DeleteCloths, gone).status.ok());
  const grpc::Status end = run.End();
  EXPECT_EQ(end.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(ReasonOf(end), "CLOTH_NOT_FOUND");
}

TEST_F(Runs, NameWhatIsWrong) {
  const auto refusal = [&](const Start& start) { return Running(*stub_, start).End(); };
  EXPECT_EQ(ReasonOf(refusal(Everything())), "NO_CLOTHS");
  Create(*stub_, HangingSheet(session_));
  v1::CreateClothsRequest other = HangingSheet(session_);
  other.mutable_spec()->mutable_settings()->set_time_step_s(0.01);
  Create(*stub_, other);
  EXPECT_THAT(FieldsOf(refusal(Everything())), testing::ElementsAre("start.steps_hz"));
  Start start = Everything();
  start.set_steps_hz(100);
  start.set_max_steps(3);
  EXPECT_TRUE(refusal(start).ok());
  start.set_unpaced(true);
  start.set_max_behind_s(-1);
  EXPECT_THAT(FieldsOf(refusal(start)),
              testing::UnorderedElementsAre("start.unpaced", "start.max_behind_s"));
  start = Everything();
  start.set_session("sessions/none");
  EXPECT_EQ(ReasonOf(refusal(start)), "SESSION_NOT_FOUND");
  start = Everything();
  start.clear_all_cloths();
  start.add_cloth_ids(42);
  EXPECT_EQ(ReasonOf(refusal(start)), "CLOTH_NOT_FOUND");
}

TEST_F(Runs, AreBoundedLikeSubscriptions) {
  Create(*stub_, HangingSheet(session_, 4));
  Start start = Everything();
  start.set_steps_hz(0.001);
  std::vector<std::unique_ptr<Running>> runs;
  for (int k = 0; k < 32; ++k) {
    runs.push_back(std::make_unique<Running>(*stub_, start));
    ASSERT_TRUE(runs.back()->Next().has_value());
  }
  const grpc::Status one_more = Running(*stub_, start).End();
  EXPECT_EQ(one_more.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(one_more), "TOO_MANY_SUBSCRIPTIONS");
}

// A viewer needs no Step: it starts the run and sees every step of it.
TEST_F(Runs, AThinViewerSeesEveryStep) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  grpc::ClientContext context;
  const auto frames = stub_->StreamStates(&context);
  v1::StreamStatesRequest subscription;
  subscription.mutable_subscribe()->set_session(session_);
  subscription.mutable_subscribe()->set_all_cloths(true);
  subscription.mutable_subscribe()->set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
  ASSERT_TRUE(frames->Write(subscription));
  v1::StateChunk chunk;
  ASSERT_TRUE(frames->Read(&chunk));
  ASSERT_EQ(chunk.steps(0), 0u);
  Start start = Everything();
  start.set_steps_hz(300);
  start.set_max_steps(100);
  Running run(*stub_, start);
  for (uint64_t step = 1; step <= 100; ++step) {
    ASSERT_TRUE(frames->Read(&chunk));
    ASSERT_EQ(chunk.steps(0), step);
  }
  EXPECT_TRUE(run.End().ok());
  context.TryCancel();
}

TEST_F(Runs, ADrainEndsThem) {
  Create(*stub_, HangingSheet(session_));
  Running run(*stub_, Everything());
  run.NextWhere([](const auto& r) { return r.steps() > 3; });
  server_.Signal(SIGTERM);
  const grpc::Status end = run.End();
  EXPECT_EQ(end.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(end), "DRAINING");
  EXPECT_EQ(server_.WaitForExit(), 0);
}

}  // namespace
}  // namespace drape::test
