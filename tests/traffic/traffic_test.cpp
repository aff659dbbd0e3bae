// Nothing is lost, doubled, mixed or shown to others, whatever is cut and killed; and the checks
// would notice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "tests/traffic/checks.h"
#include "tests/traffic/traffic.h"

namespace drape::test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

std::string Summary(const TrafficHistory& history) {
  std::map<std::string, uint64_t> counts;
  for (const WorkerHistory& worker : history.workers) {
    for (const auto& [name, count] : worker.counts) counts[name] += count;
  }
  std::string text = std::to_string(history.operations) + " operations, " +
                     std::to_string(history.cuts) + " cuts, " +
                     std::to_string(history.repetitions) + " repetitions, " +
                     std::to_string(history.runs.size() - 1) + " ends of the server;";
  for (const auto& [name, count] : counts) text += " " + name + " " + std::to_string(count);
  return text;
}

void ExpectAllIsWell(const TrafficOptions& options, const TrafficHistory& history) {
  std::printf("%s\n", Summary(history).c_str());
  EXPECT_GE(history.operations, options.operations);
  EXPECT_THAT(CheckCounts(history), IsEmpty());
  EXPECT_THAT(CheckReplay(history, options.checkpoint_interval_s), IsEmpty());
}

// One run for all: it is what takes the time.
class Traffic : public testing::Test {
 protected:
  static const TrafficOptions& options() {
    static const TrafficOptions options{.seed = 5, .operations = 1200, .run_s = 0.7};
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
  EXPECT_GE(history().runs.size(), 3u);
}

// The first acknowledged operation that `is_wanted`.
std::optional<std::pair<Epoch*, size_t>> Find(
    TrafficHistory& history, const std::function<bool(const Operation&)>& is_wanted) {
  for (WorkerHistory& worker : history.workers) {
    for (Epoch& epoch : worker.epochs) {
      for (size_t k = 0; k < epoch.operations.size(); ++k) {
        const Operation& operation = epoch.operations[k];
        if (operation.is_acknowledged && is_wanted(operation)) return std::pair(&epoch, k);
      }
    }
  }
  return std::nullopt;
}

bool IsStep(const Operation& operation) {
  return operation.kind == Kind::kStep;
}

// What would be told if a step had been lost, or done twice.
TEST_F(Traffic, ALostOrDoubledStepIsFound) {
  for (const bool is_lost : {true, false}) {
    TrafficHistory changed = history();
    const auto found = Find(changed, IsStep);
    ASSERT_TRUE(found);
    auto& operations = found->first->operations;
    const auto place = operations.begin() + static_cast<ptrdiff_t>(found->second);
    if (is_lost) {
      operations.insert(place, Operation(*place));
    } else {
      operations.erase(place);
    }
    EXPECT_THAT(CheckCounts(changed), Contains(HasSubstr("by the steps that were acknowledged")));
  }
}

// An answer with other bits.
void SpoilAnswers(TrafficHistory& history) {
  const auto bits = Find(history, [](const auto& o) { return IsStep(o) && !o.told_bits.empty(); });
  const auto reports =
      Find(history, [](const auto& o) { return IsStep(o) && !o.told_reports.empty(); });
  const auto read = Find(history, [](const auto& o) { return o.kind == Kind::kRead; });
  ASSERT_TRUE(bits && reports && read);
  bits->first->operations[bits->second].told_bits[0] ^= 1;
  reports->first->operations[reports->second].told_reports[0] ^= 1;
  read->first->operations[read->second].told_bits[0] ^= 1;
}

// A session of the last worker that has one came back with cloths of different moments.
bool Mix(TrafficHistory& history) {
  for (size_t k = history.runs.size() - 2; k > 0; --k) {
    for (auto& [session, photo] : history.runs[k].began) {
      const Photo& later = history.runs[k + 1].began.at(session);
      for (auto& [mark, seen] : photo) {
        const auto is_company = [&](const auto& entry) {
          return entry.first.worker == mark.worker;
        };
        const bool has_company = std::ranges::count_if(photo, is_company) > 1;
        if (mark.worker < 2 || !has_company || !later.contains(mark)) continue;
        if (later.at(mark) == seen) continue;
        seen = later.at(mark);
        return true;
      }
    }
  }
  return false;
}

TEST_F(Traffic, OtherBitsMixturesAndWhatIsLostTooEarlyAreFound) {
  TrafficHistory changed = history();
  ASSERT_NO_FATAL_FAILURE(SpoilAnswers(changed));
  ASSERT_TRUE(Mix(changed));
  for (ServerRun& run : changed.runs) run.was_drained = true;
  const Findings findings = CheckReplay(changed, options().checkpoint_interval_s);
  EXPECT_THAT(findings, Contains(HasSubstr("the states of an answer")));
  EXPECT_THAT(findings, Contains(HasSubstr("the reports of an answer")));
  EXPECT_THAT(findings, Contains(HasSubstr("a state that was read")));
  EXPECT_THAT(findings, Contains(HasSubstr("as they never were together")));
  EXPECT_THAT(findings, Contains(HasSubstr("that was acknowledged")));
}

TEST_F(Traffic, WhatIsHeldAtTheEndIsFound) {
  TrafficHistory changed = history();
  changed.held["drape_cloths"] = 1;
  ++changed.runs.back().shared_acknowledged;
  const Findings findings = CheckCounts(changed);
  EXPECT_THAT(findings, Contains(HasSubstr("drape_cloths is 1")));
  EXPECT_THAT(findings, Contains(HasSubstr("the shared cloth went")));
}

// Clients that repeat their steps without ids step twice, and take their own sessions for those of
// others.
TEST(TrafficFaults, ClientsThatDoWrongAreFound) {
  const TrafficHistory history = RunTraffic({.seed = 6,
                                             .operations = 800,
                                             .run_s = 0,
                                             .forgets_request_ids = true,
                                             .takes_own_sessions_for_foreign = true});
  const Findings findings = CheckCounts(history);
  EXPECT_THAT(findings, Contains(HasSubstr("by the steps that were acknowledged")));
  EXPECT_THAT(findings, Contains(HasSubstr("something of another tenant answered")));
}

TEST(TrafficLong, HundredThousandOperations) {
  const TrafficOptions options{.seed = 7, .operations = 100'000, .run_s = 3};
  ExpectAllIsWell(options, RunTraffic(options));
}

}  // namespace
}  // namespace drape::test
