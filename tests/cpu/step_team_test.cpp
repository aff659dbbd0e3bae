#include "server/solver/cpu/step/step_team.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

namespace drape::cpu {
namespace {

constexpr auto kPatience = std::chrono::seconds(20);

// False if it never comes true.
template <class Condition>
bool Await(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

// A team whose members but the leader are threads of their own.
class ThreadTeam {
 public:
  explicit ThreadTeam(uint32_t members) : team(members) {
    for (uint32_t k = 1; k < members; ++k) Add();
    EXPECT_TRUE(Await([&] { return team.member_count() == members; }));
  }
  ~ThreadTeam() { team.Close(); }

  void Add() {
    threads_.emplace_back([&] { team.Join(); });
  }

  StepTeam team;

 private:
  std::vector<std::jthread> threads_;
};

TEST(StepTeamTest, DoesEveryIndexOnce) {
  for (const uint32_t members : {1u, 2u, 3u, 5u}) {
    ThreadTeam threads(members);
    for (const size_t count : {0, 1, 7, 64, 1000, 70000}) {
      for (const size_t grain : {1, 8, 1000}) {
        std::vector<std::atomic<int>> visits(10 + count);
        std::atomic<bool> is_numbered = true;
        threads.team.AnyOf(10, 10 + count, grain, [&](size_t begin, size_t end, uint32_t member) {
          if (member >= members) is_numbered = false;
          for (size_t k = begin; k < end; ++k) ++visits[k];
          return false;
        });
        for (size_t k = 0; k < visits.size(); ++k) {
          ASSERT_EQ(visits[k], k < 10 ? 0 : 1) << members << " " << count << " " << grain;
        }
        EXPECT_TRUE(is_numbered);
      }
    }
  }
}

TEST(StepTeamTest, TellsWhetherAnyRangeSaysSo) {
  for (const uint32_t members : {1u, 3u}) {
    ThreadTeam threads(members);
    for (size_t which = 0; which <= 500; ++which) {  // 500: none
      EXPECT_EQ(threads.team.AnyOf(0, 500, 1,
                                   [&](size_t begin, size_t end, uint32_t) {
                                     return begin <= which && which < end;
                                   }),
                which < 500);
    }
  }
}

// Every reader in the next stage sees the writes of this one.
TEST(StepTeamTest, StagesFollowEachOther) {
  ThreadTeam threads(3);
  std::vector<uint32_t> numbers(512, 0), before(512, 0);
  constexpr uint32_t kStages = 2000;
  for (uint32_t stage = 0; stage < kStages; ++stage) {
    threads.team.AnyOf(0, numbers.size(), 16, [&](size_t begin, size_t end, uint32_t) {
      for (size_t k = begin; k < end; ++k) numbers[k] = before[numbers.size() - 1 - k] + 1;
      return false;
    });
    threads.team.AnyOf(0, numbers.size(), 16, [&](size_t begin, size_t end, uint32_t) {
      for (size_t k = begin; k < end; ++k) before[k] = numbers[k];
      return false;
    });
  }
  EXPECT_EQ(numbers, std::vector<uint32_t>(512, kStages));
}

// A member that is suspended in a range delays that range, not the ones that it would have taken
// next.
TEST(StepTeamTest, OthersTakeWhatASlowMemberLeaves) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    ThreadTeam threads(2);
    constexpr size_t kCount = 8;
    std::atomic<size_t> done = 0;
    std::atomic<bool> is_first = true, is_done = true;
    threads.team.AnyOf(0, kCount, 1, [&](size_t begin, size_t end, uint32_t) {
      if (is_first.exchange(false)) {
        if (!Await([&] { return done == kCount - (end - begin); })) is_done = false;
      }
      done += end - begin;
      return false;
    });
    EXPECT_TRUE(is_done) << "ranges waited for the member that was busy";
  }
}

// Whether the member of this number takes ranges, sooner or later.
bool TakesPart(StepTeam& team, uint32_t number) {
  return Await([&] {
    std::atomic<bool> has_come = false;
    team.AnyOf(0, 100, 1, [&](size_t, size_t, uint32_t member) {
      if (member == number) has_come = true;
      for (int k = 0; k < 100 && !has_come; ++k) std::this_thread::yield();
      return false;
    });
    return has_come.load();
  });
}

TEST(StepTeamTest, MembersMayComeLate) {
  StepTeam team(3);
  std::vector<std::jthread> others;
  EXPECT_TRUE(TakesPart(team, 0));
  for (const uint32_t number : {1u, 2u}) {
    others.emplace_back([&] { team.Join(); });
    EXPECT_TRUE(TakesPart(team, number));
  }
  team.Join();  // it is full: returns
  team.Close();
}

TEST(StepTeamTest, SleepersWakeUp) {
  ThreadTeam threads(2);
  for (int repeat = 0; repeat < 5; ++repeat) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_TRUE(TakesPart(threads.team, 1));
  }
}

TEST(StepTeamTest, ClosedTeamsLetGo) {
  { const ThreadTeam never_used(4); }
  StepTeam closed(2);
  closed.Close();
  EXPECT_TRUE(closed.is_closed());
  closed.Join();
}

}  // namespace
}  // namespace drape::cpu
