#include "tests/bench/accuracy/plays.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "tests/bench/accuracy/bullet_cloth.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

// Stands still; each frame takes a while, and one of them may be the last.
class StandIn final : public Contestant {
 public:
  StandIn(const AccuracyScene& scene, double frame_ms, uint32_t fault_at)
      : state_(scene.scene.state), frame_ms_(frame_ms), fault_at_(fault_at) {}

  void Restart() override {
    ++restarts;
    frame_ = 0;
  }
  FrameReport Step() override {
    std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(frame_ms_));
    ++steps;
    return {3, ++frame_ == fault_at_};
  }
  ParticleState State() override { return state_; }

  uint32_t restarts = 0;
  uint32_t steps = 0;

 private:
  ParticleState state_;
  double frame_ms_;
  uint32_t fault_at_;
  uint32_t frame_ = 0;
};

TEST(PlaysTest, TimesEveryRepeatAndStopsWhatFaultsOrTakesTooLong) {
  AccuracyScene scene{.name = "still", .title = "", .scene = test::Chain(1, 1, 1)};
  scene.duration_s = 20 * kFrame_s;
  std::vector<StandIn*> stand_ins;
  std::vector<Entry> entries;
  const auto add = [&](double frame_ms, uint32_t fault_at) {
    auto stand_in = std::make_unique<StandIn>(scene, frame_ms, fault_at);
    stand_ins.push_back(stand_in.get());
    entries.push_back({"test", {}, "", std::move(stand_in)});
  };
  add(0, 0);
  add(0, 5);
  add(50, 0);  // 1 s for the play
  const auto results =
      PlaySideBySide(entries, scene, {}, {.repeats = 2, .seconds = 10, .play_s = 0.5});

  EXPECT_EQ(results[0].status, "ok");
  EXPECT_EQ(results[0].repeats, 2u);
  EXPECT_EQ(stand_ins[0]->restarts, 3u);  // the first play is not timed
  EXPECT_EQ(stand_ins[0]->steps, 3u * 20);
  EXPECT_EQ(results[0].iterations_per_frame, 3);
  EXPECT_EQ(results[0].deviations.max_strain, 0);
  EXPECT_LE(results[0].wall_min_ms_per_s, results[0].wall_ms_per_s);
  EXPECT_LE(results[0].wall_ms_per_s, results[0].wall_max_ms_per_s);

  EXPECT_EQ(results[1].status, "faulted");
  EXPECT_EQ(stand_ins[1]->steps, 5u);
  EXPECT_TRUE(std::isnan(results[1].deviations.max_strain));

  EXPECT_EQ(results[2].status, "over_time");
  EXPECT_EQ(stand_ins[2]->steps, 2u);  // a tenth shows how long it would take
  EXPECT_GE(results[2].wall_ms_per_s, 50 * 60);
}

TEST(PlaysTest, WhatTakesLongIsPlayedOnce) {
  AccuracyScene scene{.name = "still", .title = "", .scene = test::Chain(1, 1, 1)};
  scene.duration_s = 10 * kFrame_s;
  std::vector<Entry> entries;
  entries.push_back({"test", {}, "", std::make_unique<StandIn>(scene, 2, 0)});
  const auto results =
      PlaySideBySide(entries, scene, {}, {.repeats = 5, .seconds = 0.01, .play_s = 9});
  EXPECT_EQ(results[0].status, "ok");
  EXPECT_EQ(results[0].repeats, 1u);
  // 10 frames of at least 2 ms are 1/6 s.
  EXPECT_GE(results[0].wall_ms_per_s, 20 * 6);
}

// The peer plays the same scenes by the same rules.
TEST(BulletClothTest, FallsHangsAndStaysOutsideTheSphere) {
  test::Scene sheet = test::Grid(9, 9, 1, 1, {0, 8});
  const auto hung = MakeBulletCloth(sheet, {8, 20});
  hung->Restart();
  EXPECT_EQ(hung->Step().iterations, 8u * 20);
  double lowest_m = 0;
  for (int frame = 1; frame < 60; ++frame) {
    hung->Step();
    lowest_m = std::min(lowest_m, hung->State().positions_m[80].y());
  }
  const ParticleState state = hung->State();
  EXPECT_EQ(state.positions_m[0], sheet.state.positions_m[0]);
  EXPECT_LT(lowest_m, -0.9);
  for (const DistanceConstraint& c : sheet.model->constraints()) {
    const double length_m = (state.positions_m[c.j] - state.positions_m[c.i]).norm();
    EXPECT_NEAR(length_m, c.rest_length_m, 0.05 * c.rest_length_m);
  }
  hung->Restart();
  EXPECT_EQ(hung->State().positions_m[80], sheet.state.positions_m[80]);

  test::Scene drape = test::FallingOnSphere(17);
  drape.parameters.colliders.resize(1);
  const auto lying = MakeBulletCloth(drape, {8, 20});
  lying->Restart();
  for (int frame = 0; frame < 60; ++frame) lying->Step();
  const Collider& sphere = drape.parameters.colliders[0];
  double highest_m = -1;
  double nearest_m = 1;
  for (const Vector3d& p : lying->State().positions_m) {
    highest_m = std::max(highest_m, p.y());
    nearest_m = std::min(nearest_m, SurfaceOf(sphere, p).distance_m);
  }
  EXPECT_GT(nearest_m, -0.005);
  EXPECT_NEAR(highest_m, sphere.pose.position_m.y() + std::get<SphereShape>(sphere.shape).radius_m,
              0.01);  // lies on it
}

}  // namespace
}  // namespace drape::bench
