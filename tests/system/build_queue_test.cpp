// Models are built only while somebody waits for them, and for a tenant only as long as it may.
#include "server/api/build_queue.h"

#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <thread>

#include "server/core/clock.h"
#include "server/render/gl_draw/gl_renderer.h"
#include "tests/support/backends/backends.h"

namespace drape::api {
namespace {

class BuildQueue : public testing::Test {
 protected:
  Status WhatABuildIsTold(const std::string& tenant = "") {
    const auto told = std::make_shared<std::promise<Status>>();
    const Status posted =
        PostBuild(context_, *SessionOf(tenant), {cancel_, deadline_us_},
                  [told](const Status& status, Interruption*) { told->set_value(status); });
    return posted.ok() ? told->get_future().get() : posted;
  }

  std::shared_ptr<Session> SessionOf(const std::string& tenant) {
    std::shared_ptr<Session>& session = made_[tenant];
    if (session == nullptr) session = sessions_.Create(std::nullopt, "", tenant).value().session();
    return session;
  }

  // Builds for so long, and until that is counted.
  void Build(const std::string& tenant, int64_t seconds) {
    const double before_s = Built_s();
    ASSERT_TRUE(PostBuild(context_, *SessionOf(tenant), {cancel_, deadline_us_},
                          [this, seconds](const Status& status, Interruption*) {
                            if (status.ok()) clock_.AdvanceUs(seconds * 1'000'000);
                          })
                    .ok());
    while (Built_s() == before_s) std::this_thread::yield();
  }
  double Built_s() const {
    double sum_s = 0;
    for (const RateUse& use : quota_->rates.Uses()) sum_s += use.work;
    return sum_s;
  }

  FakeClock clock_;
  const std::unique_ptr<Scheduler> scheduler_ =
      Scheduler::Start(
          []() -> Result<std::unique_ptr<Backend>> { return test::MakeBackend("cpu"); }, {}, clock_)
          .value();
  SessionRegistry sessions_{*scheduler_, {}, clock_, "test"};
  std::map<std::string, std::shared_ptr<Session>> made_;
  WorkerPool builders_{1, 16};
  render::RenderThread pictures_{[] { return render::CreateGlRenderer({}); }, {}};
  const std::shared_ptr<BuildQuota> quota_ = std::make_shared<BuildQuota>(clock_);
  const ServiceContext context_{*scheduler_, sessions_, builders_, pictures_, clock_,
                                {},          "test",    "test",    nullptr,   nullptr,
                                nullptr,     nullptr,   nullptr,   quota_};
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
  ASSERT_TRUE(PostBuild(context_, *SessionOf(""), {cancel_, deadline_us_},
                        [told](const Status& status, Interruption*) {
                          if (status.ok()) throw std::bad_alloc();
                          told->set_value(status);
                        })
                  .ok());
  EXPECT_EQ(told->get_future().get().reason(), "DEVICE_MEMORY");
  EXPECT_TRUE(WhatABuildIsTold().ok()) << "the builder goes on";
}

// A build that has begun asks whether it is still wanted.
TEST_F(BuildQueue, ABuildStopsWithTheReason) {
  const auto what_a_build_that_runs_is_told = [&](const std::function<void()>& meanwhile) {
    std::promise<void> has_begun;
    std::promise<Status> told;
    EXPECT_TRUE(PostBuild(context_, *SessionOf(""), {cancel_, deadline_us_},
                          [&](const Status& status, Interruption* interruption) {
                            if (!status.ok()) return told.set_value(status);
                            has_begun.set_value();
                            const auto until =
                                std::chrono::steady_clock::now() + std::chrono::seconds(10);
                            while (std::chrono::steady_clock::now() < until) interruption->Check();
                            told.set_value(status);
                          })
                    .ok());
    has_begun.get_future().wait();
    meanwhile();
    return told.get_future().get();
  };
  deadline_us_ = clock_.NowUs() + 1;
  EXPECT_EQ(what_a_build_that_runs_is_told([&] { clock_.AdvanceUs(1); }).reason(),
            "DEADLINE_PASSED");
  deadline_us_ = std::numeric_limits<int64_t>::max();
  EXPECT_EQ(what_a_build_that_runs_is_told([&] { cancel_.Cancel(); }).code(),
            StatusCode::kCancelled);
  cancel_ = CancelToken();
  EXPECT_EQ(what_a_build_that_runs_is_told([&] { scheduler_->Drain(0); }).reason(), "DRAINING");
}

TEST_F(BuildQueue, BuildsNothingWhileTheServerShutsDown) {
  SessionOf("");
  scheduler_->Drain(0);
  EXPECT_EQ(WhatABuildIsTold().reason(), "DRAINING");
}

// Half a second per second; what a minute saves up is 30 s.
TEST_F(BuildQueue, ATenantThatHasHadItsTimeIsRefusedUntilItHasPaid) {
  quota_->rates.Set({.per_tenant = 0.5});
  Build("greedy", 30);
  EXPECT_TRUE(WhatABuildIsTold("greedy").ok()) << "no debt yet";
  Build("greedy", 1);
  const Status refused = WhatABuildIsTold("greedy");
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.reason(), "BUILD_TIME_EXCEEDED");
  // Of the second 0.5 s came while it was built; the rest takes a second.
  EXPECT_EQ(refused.retry_after_ms(), 1001);
  EXPECT_EQ(quota_->refused, 1u);
  EXPECT_TRUE(WhatABuildIsTold("modest").ok());
  EXPECT_TRUE(WhatABuildIsTold().ok()) << "without tenants";
  clock_.AdvanceUs(*refused.retry_after_ms() * 1000);
  EXPECT_TRUE(WhatABuildIsTold("greedy").ok());
}

TEST_F(BuildQueue, ABuildThatWaitsIsRefusedAtItsTurnAndOneThatRunsGoesOn) {
  quota_->rates.Set({.per_tenant = 0.5});
  const std::shared_ptr<Session> session = SessionOf("greedy");
  std::promise<void> go_on;
  std::promise<Status> first, second;
  ASSERT_TRUE(PostBuild(context_, *session, {cancel_, deadline_us_},
                        [&](const Status& status, Interruption*) {
                          go_on.get_future().wait();
                          clock_.AdvanceUs(100'000'000);
                          first.set_value(status);
                        })
                  .ok());
  ASSERT_TRUE(PostBuild(context_, *session, {cancel_, deadline_us_},
                        [&](const Status& status, Interruption*) { second.set_value(status); })
                  .ok());
  go_on.set_value();
  EXPECT_TRUE(first.get_future().get().ok());
  EXPECT_EQ(second.get_future().get().reason(), "BUILD_TIME_EXCEEDED");
}

}  // namespace
}  // namespace drape::api
