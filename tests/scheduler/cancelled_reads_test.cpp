// Reads whose clients have gone before their turn.
#include <gtest/gtest.h>

#include <utility>

#include "tests/scheduler/scheduler_fixture.h"

namespace drape {
namespace {

using CancelledReads = SchedulerTest;

TEST_F(CancelledReads, NothingIsReadForThoseWhoHaveGone) {
  Start();
  const auto cloth = Cloth();
  CancelToken gone;
  gone.Cancel();
  Awaited<Result<ClothStates>> read, drawn;
  const auto into = [](Awaited<Result<ClothStates>> result) {
    return [result](Result<ClothStates> r) mutable { result.Set(std::move(r)); };
  };
  EXPECT_TRUE(scheduler_->ReadStates({cloth}, {true, false}, into(read), "a", "", gone).ok());
  EXPECT_TRUE(
      scheduler_->ReadForDrawing({cloth}, {true, false}, false, into(drawn), "a", "", gone).ok());
  EXPECT_EQ(read.Get().status().code(), StatusCode::kCancelled);
  EXPECT_EQ(drawn.Get().status().code(), StatusCode::kCancelled);
  EXPECT_TRUE(device_->reads().empty());
}

}  // namespace
}  // namespace drape
