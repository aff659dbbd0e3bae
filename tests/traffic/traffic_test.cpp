// Nothing is lost, doubled, mixed or shown to others, whatever is cut and killed; and the checks
// would notice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <iterator>
#include <optional>

#include "tests/system/server_process.h"
#include "tests/traffic/checks.h"
#include "tests/traffic/sight.h"
#include "tests/traffic/traffic.h"

namespace drape::test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

// The choices of the workers and when the server ends. What meets what still depends on the
// machine.
uint32_t SeedOr(uint32_t seed) {
  const char* const asked = std::getenv("DRAPE_TRAFFIC_SEED");
  return asked == nullptr ? seed : static_cast<uint32_t>(std::atoi(asked));
}

// Into the output of the test, and of gtest (--gtest_output).
void Tell(const std::string& name, uint64_t count) {
  std::cout << count << " " << name << "; ";
  testing::Test::RecordProperty(name, std::to_string(count));
}

void TellAll(const TrafficHistory& history, const Verdict& verdict) {
  Tell("operations", history.operations);
  Tell("cuts", history.cuts);
  Tell("kills", history.kills);
  Tell("drains", history.drains);
  Tell("retries", history.repetitions);
  Tell("steps", verdict.steps_checked);
  Tell("lost", verdict.lost_steps);
  Tell("doubled", verdict.doubled_steps);
  Tell("frames", verdict.frames_checked);
  Tell("findings", verdict.findings.size());
  Tell("oldest_checkpoint_ms", static_cast<uint64_t>(1000 * history.oldest_checkpoint_s));
  std::map<std::string, uint64_t> counts;
  for (const WorkerHistory& worker : history.workers) {
    for (const auto& [name, count] : worker.counts) counts[name] += count;
  }
  std::cout << "of these";
  for (const auto& [name, count] : counts) std::cout << " " << name << " " << count;
  std::cout << "\n";
}

void ExpectAllIsWell(const TrafficOptions& options, const TrafficHistory& history) {
  Verdict verdict = CheckCounts(history);
  Verdict replayed = CheckReplay(history);
  verdict.lost_steps += replayed.lost_steps;
  std::ranges::move(replayed.findings, std::back_inserter(verdict.findings));
  TellAll(history, verdict);
  EXPECT_GE(history.operations, options.operations);
  EXPECT_THAT(verdict.findings, IsEmpty()) << "again: DRAPE_TRAFFIC_SEED=" << options.seed;
  EXPECT_EQ(verdict.lost_steps, 0u);
  EXPECT_EQ(verdict.doubled_steps, 0u);
}

// One run for all: it is what takes the time.
class Traffic : public testing::Test {
 protected:
  static const TrafficOptions& options() {
    static const TrafficOptions options{.seed = SeedOr(5), .operations = 1200};
    return options;
  }
  static const TrafficHistory& history() {
    static const TrafficHistory history = RunTraffic(options());
    return history;
  }
};

TEST_F(Traffic, NothingIsLostOrDoubledOverCutsAndKills) {
  ExpectAllIsWell(options(), history());
  EXPECT_GT(history().cuts, 50u);
  EXPECT_GT(history().repetitions, 50u);
  EXPECT_GE(history().kills, 2u);
  EXPECT_GE(history().drains, 1u);
}

bool IsStep(const Operation& operation) {
  return operation.kind == Kind::kStep && operation.told_faulted.empty();
}

// The first acknowledged operation that `is_wanted`.
Operation* Find(TrafficHistory& history, const std::function<bool(const Operation&)>& is_wanted) {
  for (WorkerHistory& worker : history.workers) {
    for (Epoch& epoch : worker.epochs) {
      for (Operation& operation : epoch.operations) {
        if (operation.is_acknowledged && is_wanted(operation)) return &operation;
      }
    }
  }
  return nullptr;
}

// What would be told if a step had been lost, or done twice.
TEST_F(Traffic, ALostOrDoubledStepIsFound) {
  for (const bool is_lost : {true, false}) {
    TrafficHistory changed = history();
    Operation* const step = Find(changed, IsStep);
    ASSERT_NE(step, nullptr);
    step->told_steps[0] += is_lost ? uint64_t{0} - 1 : 1;
    const Verdict verdict = CheckCounts(changed);
    EXPECT_THAT(verdict.findings, Contains(HasSubstr("by the steps that were acknowledged")));
    EXPECT_GT(is_lost ? verdict.lost_steps : verdict.doubled_steps, 0u);
  }
}

// Answers with other bits and another report, each of another worker.
TEST_F(Traffic, AnswersWithOtherBitsAreFound) {
  const struct {
    std::function<bool(const Operation&)> is_wanted;
    std::function<void(Operation&)> spoil;
    const char* finding;
  } faults[] = {{[](const Operation& o) { return IsStep(o) && !o.told_bits.empty(); },
                 [](Operation& o) { o.told_bits[0] ^= 1; }, "the states of an answer"},
                {[](const Operation& o) { return IsStep(o) && !o.told_reports.empty(); },
                 [](Operation& o) { o.told_reports[0] ^= 1; }, "the reports of an answer"},
                {[](const Operation& o) { return o.kind == Kind::kRead; },
                 [](Operation& o) { o.told_bits[0] ^= 1; }, "a state that was read"}};
  const TrafficHistory& told = history();
  for (size_t k = 0; k < std::size(faults); ++k) {
    TrafficHistory of_one = told;
    of_one.workers = {told.workers[k + 1]};
    Operation* const operation = Find(of_one, faults[k].is_wanted);
    ASSERT_NE(operation, nullptr) << faults[k].finding;
    faults[k].spoil(*operation);
    EXPECT_THAT(CheckReplay(of_one).findings, Contains(HasSubstr(faults[k].finding)));
  }
}

bool IsSeenRun(const Operation& operation) {
  return operation.kind == Kind::kRun && operation.is_shown_to_the_end &&
         operation.told_faulted.empty() && operation.told_run_steps > 1;
}

// A run that made a step too many or too few, and frames that are missing or of another state.
TEST_F(Traffic, WrongRunsAndFramesAreFound) {
  const struct {
    std::function<void(Operation&)> spoil;
    const char* finding;
    bool is_counted;
  } faults[] = {{[](Operation& o) { o.told_run_steps += 20; }, "after a run from", true},
                {[](Operation& o) { o.told_steps[0] += 20; }, "after a run from", true},
                {[](Operation& o) { o.shown.begin()->second.pop_back(); }, "the last frame", true},
                {[](Operation& o) {
                   auto& frames = o.shown.begin()->second;
                   frames.erase(frames.begin() + 1);
                 },
                 "a frame of", true},
                {[](Operation& o) { o.shown.begin()->second.back().bits ^= 1; },
                 "a frame is not the state", false}};
  for (const WorkerHistory& worker : history().workers) {
    TrafficHistory of_one = history();
    of_one.workers = {worker};
    if (Find(of_one, IsSeenRun) == nullptr) continue;
    for (const auto& fault : faults) {
      TrafficHistory changed = of_one;
      fault.spoil(*Find(changed, IsSeenRun));
      const Verdict verdict = fault.is_counted ? CheckCounts(changed) : CheckReplay(changed);
      EXPECT_THAT(verdict.findings, Contains(HasSubstr(fault.finding)));
    }
    return;
  }
  FAIL() << "nobody saw a run to its end";
}

// Two cloths of a worker that both went on, by more than a request's steps, between two starts.
struct Pair {
  size_t run = 0;  // that began at the later start
  std::string session;
  std::array<Mark, 2> marks;
};

std::optional<Pair> FindPair(const TrafficHistory& history) {
  constexpr uint64_t kMostSteps = 3;  // of a request of the workers
  for (size_t k = 0; k + 1 < history.runs.size(); ++k) {
    for (const auto& [session, photo] : history.runs[k + 1].began) {
      const Photo& former = history.runs[k].began.at(session);
      const auto has_gone_on = [&](const Mark& mark) {
        return former.contains(mark) && photo.at(mark).step > former.at(mark).step + kMostSteps;
      };
      // Only a worker that did something before that start, and after it or never again, knows it.
      const auto knows = [&](uint32_t worker) {
        const std::vector<Epoch>& epochs = history.workers[worker - 1].epochs;
        if (epochs.empty() || epochs.front().incarnation == history.runs[k + 1].incarnation) {
          return false;
        }
        const bool is_last = k + 2 == history.runs.size();
        return is_last || std::ranges::any_of(epochs, [&](const Epoch& epoch) {
                 return epoch.incarnation == history.runs[k + 1].incarnation;
               });
      };
      for (const auto& [mark, seen] : photo) {
        if (mark.worker == 0 || !has_gone_on(mark) || !knows(mark.worker)) continue;
        for (const auto& [other, its_seen] : photo) {
          if (other.worker != mark.worker || other == mark || !has_gone_on(other)) continue;
          return Pair{.run = k + 1, .session = session, .marks = {mark, other}};
        }
      }
    }
  }
  return std::nullopt;
}

// One of two cloths came back as it had been one start earlier. If the other had gone on before
// this one did, both were so at one moment: then it is the other's turn that was never so.
TEST_F(Traffic, MixturesOfMomentsAreFound) {
  const std::optional<Pair> pair = FindPair(history());
  ASSERT_TRUE(pair.has_value());
  std::vector<std::string> findings;
  for (const Mark& mark : pair->marks) {
    TrafficHistory changed = history();
    const Photo& former = changed.runs[pair->run - 1].began.at(pair->session);
    changed.runs[pair->run].began.at(pair->session).at(mark) = former.at(mark);
    changed.workers = {changed.workers[mark.worker - 1]};
    std::ranges::copy(CheckReplay(changed).findings, std::back_inserter(findings));
  }
  EXPECT_THAT(findings, Contains(HasSubstr("as they never were together")));
}

// Kills take back what was acknowledged after the last checkpoint: as if they should not. At the
// end cloths look as they were, but would go on differently.
TEST_F(Traffic, WhatIsLostTooEarlyAndWhatIsNotSeenAreFound) {
  TrafficHistory changed = history();
  for (ServerRun& run : changed.runs) run.kept_until_s = run.ended_s;
  for (auto& [session, photo] : changed.ended) {
    for (auto& [mark, seen] : photo) seen.whole += " ";
  }
  Verdict verdict = CheckCounts(changed);
  verdict.Add(CheckReplay(changed));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("before the end is lost")));
  EXPECT_GT(verdict.lost_steps, 0u);
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("would go on differently")));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("the shared cloth has other bits")));
}

TEST_F(Traffic, WhatIsHeldAtTheEndAndIdsGivenTwiceAreFound) {
  TrafficHistory changed = history();
  changed.held["drape_cloths"] = 1;
  changed.runs.back().shared_acknowledged_s.push_back(0);
  ASSERT_FALSE(changed.workers[1].ids.empty());
  changed.workers[0].ids.push_back(changed.workers[1].ids[0]);
  const Verdict verdict = CheckCounts(changed);
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("drape_cloths is 1")));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("the shared cloth went")));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("was given twice")));
}

// A sheet of an environment whose name is the mark.
v1::CreateClothsRequest SheetOf(const Mark& mark, double gravity_m_per_s2) {
  v1::CreateClothsRequest creation;
  v1::Grid& grid = *creation.mutable_spec()->mutable_grid();
  grid.set_columns(3);
  grid.set_rows(3);
  grid.set_width_m(1);
  grid.set_height_m(1);
  auto& gravity = *creation.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2();
  for (const double component : {0.0, -gravity_m_per_s2, 0.0}) gravity.Add(component);
  creation.set_count(1);
  SetOrigin(mark, creation.mutable_environment_origins_m());
  return creation;
}

// A cloth that faults in a step looks afterwards as it did before, and yet is not as it was. A
// server that ends then may have kept either.
TEST(TrafficReplay, KnowsAClothThatFaultsBeforeAndAfterItsStep) {
  constexpr Mark kGood{1, 1}, kFaults{1, 2};
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const Client client = Client::Connect(server.Address());
  Session shared = client.CreateSession(), session = client.CreateSession();
  TrafficHistory history;
  history.shared_session = shared.name();
  history.shared_creation = SheetOf({}, 9.8);
  (void)shared.CreateCloths(history.shared_creation);
  std::vector<Operation> operations;
  v1::StepRequest step;
  step.set_steps(1);
  for (const auto& [mark, gravity] : {std::pair(kGood, 9.8), std::pair(kFaults, 1e11)}) {
    Operation& creation = operations.emplace_back();
    creation.kind = Kind::kCreate;
    creation.cloths = {mark};
    creation.creation = SheetOf(mark, gravity);
    creation.is_acknowledged = true;
    step.add_cloth_ids(session.CreateCloths(creation.creation).cloth_ids(0));
  }
  Operation& stepping = operations.emplace_back();
  stepping.kind = Kind::kStep;
  stepping.cloths = {kGood, kFaults};
  stepping.step = step;
  history.runs = {{.incarnation = "only", .began = {{session.name(), {}}}}};
  history.runs[0].began[shared.name()] = Look(shared).photo;
  WorkerHistory& worker = history.workers.emplace_back();
  worker.worker = 1;
  worker.session = session.name();
  worker.epochs = {{"only", operations}};
  for (const bool has_stepped : {false, true}) {
    if (has_stepped) {
      ASSERT_EQ(session.Step(step).faulted_cloth_ids_size(), 1);
    }
    history.ended = {{session.name(), Look(session).photo}, {shared.name(), Look(shared).photo}};
    EXPECT_THAT(CheckReplay(history).findings, IsEmpty()) << has_stepped;
  }
}

// Clients that repeat their steps without ids step twice, and take their own sessions for those of
// others.
TEST(TrafficFaults, ClientsThatDoWrongAreFound) {
  const TrafficHistory history = RunTraffic({.seed = SeedOr(6),
                                             .operations = 600,
                                             .operations_per_run = 0,
                                             .forgets_request_ids = true,
                                             .takes_own_sessions_for_foreign = true});
  const Verdict verdict = CheckCounts(history);
  EXPECT_GT(verdict.doubled_steps, 0u);
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("something of another tenant answered")));
}

// What `./run bench service` writes down. Minutes.
TEST(TrafficLong, HundredThousandOperations) {
  const TrafficOptions options{.seed = SeedOr(7),
                               .operations = 100'000,
                               .operations_per_run = 300,
                               .touch_themselves = true};
  ExpectAllIsWell(options, RunTraffic(options));
}

}  // namespace
}  // namespace drape::test
