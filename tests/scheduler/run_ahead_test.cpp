// Answers whose states are on their way while a backend that runs ahead steps the next batch.
#include <gtest/gtest.h>

#include "tests/scheduler/device_loop_fixture.h"
#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

class RunAheadLoopTest : public DeviceLoopTest {
 protected:
  RunAheadLoopTest() { device_->RunAhead(); }

  StepWork Viewing(const std::string& name, const std::shared_ptr<ClothRuntime>& cloth,
                   uint32_t steps = 1) {
    StepWork work = Work(name, {cloth}, steps);
    work.view = {true, false};
    return work;
  }
  // Height of the first particle: minus the steps taken.
  double HeightOf(const std::string& name) {
    return std::get<std::vector<double>>(outcomes_.at(name).states->positions_m)[1];
  }
};

TEST_F(RunAheadLoopTest, AnAnswerIsGivenWhileTheNextBatchIsStepped) {
  const auto a = Cloth();
  Admit(Viewing("one", a));
  loop_->RunRound();
  EXPECT_FALSE(loop_->has_requests());
  EXPECT_TRUE(ended_.empty()) << "its states are on their way";
  Admit(Viewing("two", a, 2));
  std::vector<std::string> ended_before_step;
  device_->OnStep([&] { ended_before_step = ended_; });
  loop_->RunRound();
  EXPECT_TRUE(ended_before_step.empty());
  EXPECT_EQ(ended_, std::vector<std::string>{"one"});
  EXPECT_EQ(HeightOf("one"), -1) << "as they were, though the cloth has been stepped again";
  EXPECT_EQ(outcomes_["one"].cloths[0].stamp.completed_steps, 1u);
  loop_->RunRound();
  EXPECT_FALSE(loop_->has_requests());
  loop_->GiveAnswers();
  EXPECT_EQ(ended_, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(HeightOf("two"), -3);
  loop_->GiveAnswers();
  EXPECT_EQ(ended_.size(), 2u);
}

TEST_F(RunAheadLoopTest, AnswersStayInOrder) {
  const auto a = Cloth(), b = Cloth(), c = Cloth();
  Admit(Viewing("first", a));
  Admit(Work("acknowledged", {b}));
  Admit(Work("long", {c}, 2));
  loop_->RunRound();
  EXPECT_TRUE(ended_.empty());
  loop_->RunRound();  // the first two during the step, the last at once: nothing is awaited
  EXPECT_EQ(ended_, (std::vector<std::string>{"first", "acknowledged", "long"}));
}

TEST_F(RunAheadLoopTest, WithoutStatesNothingStaysBehind) {
  Admit(Work("one", {Cloth()}));
  loop_->RunRound();
  EXPECT_EQ(ended_, std::vector<std::string>{"one"});
}

TEST_F(RunAheadLoopTest, ARoundWithoutABatchGivesThem) {
  Admit(Viewing("one", Cloth()));
  loop_->RunRound();
  EXPECT_FALSE(loop_->RunRound().has_value());
  EXPECT_EQ(ended_, std::vector<std::string>{"one"});
}

TEST_F(RunAheadLoopTest, TheEndGivesThem) {
  Admit(Viewing("one", Cloth()));
  loop_->RunRound();
  loop_->EndAll({StatusCode::kUnavailable, "DRAINING", "over"});
  EXPECT_TRUE(outcomes_.at("one").status.ok());
  EXPECT_EQ(HeightOf("one"), -1);
}

class RunAheadSchedulerTest : public SchedulerTest {
 protected:
  RunAheadSchedulerTest() { device_->RunAhead(); }

  Awaited<StepOutcome> SubmitViewing(const std::shared_ptr<ClothRuntime>& cloth,
                                     const std::string& session = "viewer") {
    Awaited<StepOutcome> outcome;
    StepWork work;
    work.session = session;
    work.cloths = {cloth};
    work.steps = 1;
    work.view = {true, false};
    work.done = [outcome](StepOutcome o) mutable { outcome.Set(std::move(o)); };
    EXPECT_TRUE(scheduler_->Submit(std::move(work)).ok());
    return outcome;
  }
};

TEST_F(RunAheadSchedulerTest, NobodyWaitsForAStepThatDoesNotCome) {
  Start();
  const auto cloth = Cloth();
  for (int k = 1; k <= 3; ++k) {
    const StepOutcome outcome = SubmitViewing(cloth).Get();
    EXPECT_EQ(std::get<std::vector<double>>(outcome.states->positions_m)[1], -k);
  }
}

TEST_F(RunAheadSchedulerTest, OfTwoUnderWayEachHasItsOwnStates) {
  Start();
  const auto cloth = Cloth();
  scheduler_->HoldForTest();
  const auto one = SubmitViewing(cloth), two = SubmitViewing(cloth);
  scheduler_->ReleaseForTest();
  EXPECT_EQ(std::get<std::vector<double>>(one.Get().states->positions_m)[1], -1);
  EXPECT_EQ(std::get<std::vector<double>>(two.Get().states->positions_m)[1], -2);
  EXPECT_EQ(device_->batches().size(), 2u);
}

// Submitted while the first batch is stepped, the request is the second batch. Whether the answer
// to the first has come when the second begins.
class AnswerBeforeNextBatchTest : public RunAheadSchedulerTest {
 protected:
  // `wait`: for as long as it takes.
  bool IsAnsweredBefore(const std::string& second_session, bool wait) {
    Start();
    const auto one = Cloth(), two = Cloth();
    Awaited<StepOutcome> first, second;
    size_t step = 0;
    bool is_answered = false;
    scheduler_->HoldForTest();
    device_->OnStep([&] {
      if (step++ == 0) {
        second = SubmitViewing(two, second_session);
      } else {
        if (wait) first.Get();
        is_answered = first.has_value();
      }
    });
    first = SubmitViewing(one, "first");
    scheduler_->ReleaseForTest();
    first.Get();
    while (device_->batches().size() < 2) std::this_thread::yield();
    second.Get();
    EXPECT_EQ(step, 2u);
    return is_answered;
  }
};

TEST_F(AnswerBeforeNextBatchTest, OfTheSameSessionItStaysBehind) {
  EXPECT_FALSE(IsAnsweredBefore("first", false));
}

// It may come back at once, and the batch is to wait for it then (Gathering).
TEST_F(AnswerBeforeNextBatchTest, OfASessionWithNothingElseUnderWayItIsGiven) {
  EXPECT_TRUE(IsAnsweredBefore("other", true));
}

}  // namespace
}  // namespace drape
