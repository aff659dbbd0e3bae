#include "server/solver/pausable_work.h"

#include <gtest/gtest.h>

#include <new>
#include <thread>

#include "server/solver/drop_when_due.h"

namespace drape {
namespace {

const Pause kDue = Pause::At({});

TEST(PausableWork, StopsWhereItChecksAndGoesOnThere) {
  int at = 0;
  const auto work = PausableWork::Begin([&](Interruption& interruption, const Pause&) {
    for (at = 1; at < 4; ++at) interruption.Check();
  });
  EXPECT_EQ(at, 0) << "nothing is done before it is continued";
  for (int piece = 1; piece < 4; ++piece) {
    EXPECT_FALSE(work->Continue(kDue));
    EXPECT_EQ(at, piece);
  }
  EXPECT_TRUE(work->Continue(kDue));
  EXPECT_EQ(at, 4);
}

TEST(PausableWork, KnowsThePauseOfThePieceUnderWay) {
  const auto work = PausableWork::Begin([](Interruption& interruption, const Pause& pause) {
    EXPECT_TRUE(pause.IsDue());
    interruption.Check();
    EXPECT_TRUE(pause.is_never());
    interruption.Check();
  });
  EXPECT_FALSE(work->Continue(kDue));
  EXPECT_TRUE(work->Continue(Pause::Never()));
}

// What it holds is given back, by the thread that it began with.
TEST(PausableWork, IsDroppedWhereItHasStopped) {
  struct Held {
    std::thread::id* ended_by;
    ~Held() { *ended_by = std::this_thread::get_id(); }
  };
  for (const int pieces : {0, 1, 2}) {
    std::thread::id begun_by, ended_by;
    bool is_past = false;
    auto work = PausableWork::Begin([&](Interruption& interruption, const Pause&) {
      begun_by = std::this_thread::get_id();
      const Held held{&ended_by};
      interruption.Check();
      interruption.Check();
      is_past = true;
    });
    for (int k = 0; k < pieces; ++k) EXPECT_FALSE(work->Continue(kDue));
    work.reset();
    EXPECT_EQ(ended_by, begun_by);
    EXPECT_FALSE(is_past);
  }
}

TEST(PausableWork, PassesOnWhatItThrows) {
  const auto work = PausableWork::Begin([](Interruption& interruption, const Pause&) {
    interruption.Check();
    throw std::bad_alloc();
  });
  EXPECT_FALSE(work->Continue(kDue));
  EXPECT_THROW((void)work->Continue(kDue), std::bad_alloc);
}

TEST(Interruption, DropsWhatIsDue) {
  DropWhenDue due(kDue);
  EXPECT_THROW(due.Check(), WorkStopped);
  const Pause never = Pause::Never();
  DropWhenDue not_due(never);
  EXPECT_NO_THROW(not_due.Check());
  SeldomInterruption seldom(&due);
  int times = 0;
  EXPECT_THROW(
      for (;;) {
        seldom.Check();
        ++times;
      },
      WorkStopped);
  EXPECT_GT(times, 1000);
}

}  // namespace
}  // namespace drape
