#include "server/render/picture_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/render/fake_renderer.h"

namespace drape::render {
namespace {

using testing::ElementsAre;

class PictureQueueTest : public testing::Test {
 protected:
  void Push(const std::string& session, uint32_t width_px) {
    queue_.Push(Job(session, width_px, {}));
  }
  std::vector<uint32_t> PopAll() {
    std::vector<uint32_t> widths;
    while (!queue_.empty()) {
      const uint32_t next = queue_.Next().spec.width_px;
      widths.push_back(queue_.Pop().spec.width_px);
      EXPECT_EQ(widths.back(), next);
    }
    return widths;
  }
  PictureQueue queue_;
};

TEST_F(PictureQueueTest, SessionsTakeTurnsAndEachKeepsItsOrder) {
  for (const uint32_t width : {1, 2, 3}) Push("a", width);
  Push("b", 11);
  Push("b", 12);
  Push("c", 21);
  EXPECT_EQ(queue_.size(), 6u);
  EXPECT_THAT(PopAll(), ElementsAre(1, 11, 21, 2, 12, 3));
}

TEST_F(PictureQueueTest, ATenantHasNoMoreTurnsWithMoreSessions) {
  const auto push = [&](const std::string& session, const std::string& tenant, uint32_t width_px) {
    PictureJob job = Job(session, width_px, {});
    job.tenant = tenant;
    queue_.Push(std::move(job));
  };
  push("a", "greedy", 1);
  push("a", "greedy", 2);
  push("b", "greedy", 11);
  push("c", "greedy", 21);
  push("d", "modest", 31);
  push("d", "modest", 32);
  Push("alone", 41);
  EXPECT_EQ(queue_.size_of("x", "greedy"), 4u);
  EXPECT_EQ(queue_.size_of("alone", ""), 1u);
  EXPECT_EQ(queue_.size_of("d", ""), 0u);
  EXPECT_THAT(PopAll(), ElementsAre(1, 31, 41, 11, 32, 21, 2));
}

TEST_F(PictureQueueTest, WhoComesLaterWaitsForOneTurnOfTheOthersAtMost) {
  for (const uint32_t width : {1, 2, 3}) Push("a", width);
  EXPECT_EQ(queue_.Pop().spec.width_px, 1u);
  Push("b", 11);
  EXPECT_THAT(PopAll(), ElementsAre(2, 11, 3));
}

TEST_F(PictureQueueTest, WhatIsReturnedIsFirst) {
  Push("a", 1);
  Push("b", 11);
  PictureJob first = queue_.Pop();
  Push("a", 2);
  queue_.Return(std::move(first));
  EXPECT_EQ(queue_.size(), 3u);
  EXPECT_THAT(PopAll(), ElementsAre(1, 11, 2));
}

TEST_F(PictureQueueTest, CancelledOnesAreTakenOutWhereverTheyWait) {
  bool is_cancelled = false;
  const auto push_cancelled = [&](const std::string& session, uint32_t width_px) {
    PictureJob job = Job(session, width_px, {});
    job.is_cancelled = [&] { return is_cancelled; };
    queue_.Push(std::move(job));
  };
  push_cancelled("gone", 1);
  push_cancelled("half", 11);
  Push("half", 12);
  Push("here", 21);
  queue_.Return(queue_.Pop());  // 1
  EXPECT_TRUE(queue_.TakeCancelled().empty());
  is_cancelled = true;
  EXPECT_EQ(queue_.TakeCancelled().size(), 2u);
  EXPECT_THAT(PopAll(), ElementsAre(12, 21));
}

TEST_F(PictureQueueTest, AllCanBeTakenAtOnce) {
  Push("a", 1);
  Push("b", 2);
  EXPECT_EQ(queue_.TakeAll().size(), 2u);
  EXPECT_TRUE(queue_.empty());
}

}  // namespace
}  // namespace drape::render
