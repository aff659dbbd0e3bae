// Models are built only while somebody waits for them.
#include "server/api/build_queue.h"

#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <memory>
#include <new>

#include "server/core/clock.h"
#include "server/render/gl_draw/gl_renderer.h"
#include "tests/support/backends/backends.h"

namespace drape::api {
namespace {

class BuildQueue : public testing::Test {
 protected:
  Status WhatABuildIsTold() {
    const auto told = std::make_shared<std::promise<Status>>();
    const Status posted = PostBuild(context_, "sessions/test", {cancel_, deadline_us_},
                                    [told](const Status& status) { told->set_value(status); });
    return posted.ok() ? told->get_future().get() : posted;
  }

  SteadyClock clock_;
  const std::unique_ptr<Scheduler> scheduler_ =
      Scheduler::Start(
          []() -> Result<std::unique_ptr<Backend>> { return test::MakeBackend("cpu"); }, {}, clock_)
          .value();
  SessionRegistry sessions_{*scheduler_, {}, clock_, "test"};
  WorkerPool builders_{1, 16};
  render::RenderThread pictures_{[] { return render::CreateGlRenderer({}); }, {}};
  const ServiceContext context_{*scheduler_, sessions_, builders_, pictures_,
                                clock_,      {},        "test",    "test"};
  CancelToken cancel_;
  int64_t deadline_us_ = std::numeric_limits<int64_t>::max();
};

TEST_F(BuildQueue, BuildsForAClientThatWaits) {
  EXPECT_TRUE(WhatABuildIsTold().ok());
}

TEST_F(BuildQueue, BuildsNothingForAClientThatHasGone) {
  cancel_.Cancel();
  EXPECT_EQ(WhatABuildIsTold().code(), StatusCode::kCancelled);
}

TEST_F(BuildQueue, BuildsNothingAfterTheDeadline) {
  deadline_us_ = clock_.NowUs();
  EXPECT_EQ(WhatABuildIsTold().reason(), "DEADLINE_PASSED");
}

TEST_F(BuildQueue, ABuildForWhichThereIsNoMemoryIsTold) {
  const auto told = std::make_shared<std::promise<Status>>();
  ASSERT_TRUE(
      PostBuild(context_, "sessions/test", {cancel_, deadline_us_}, [told](const Status& status) {
        if (status.ok()) throw std::bad_alloc();
        told->set_value(status);
      }).ok());
  EXPECT_EQ(told->get_future().get().reason(), "DEVICE_MEMORY");
  EXPECT_TRUE(WhatABuildIsTold().ok()) << "the builder goes on";
}

TEST_F(BuildQueue, BuildsNothingWhileTheServerShutsDown) {
  scheduler_->Drain(0);
  EXPECT_EQ(WhatABuildIsTold().reason(), "DRAINING");
}

}  // namespace
}  // namespace drape::api
