// Leaving out colliders that a cloth cannot reach changes nothing, to the bit, along both paths.
#include "server/solver/cpu/step/find_reach.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/cpu/alone/advance.h"
#include "server/solver/cpu/alone/cloth_step.h"
#include "server/solver/cpu/alone/contacts.h"
#include "server/solver/cpu/side_by_side/group_step.h"
#include "server/solver/cpu/step/collider_gap.h"
#include "server/solver/cpu/step/collider_surface.h"
#include "server/solver/cpu/step/step_team.h"
#include "tests/support/reach_scenes.h"
#include "tests/support/reports.h"
#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

using Eigen::Vector3d;
using test::Scene;

std::vector<Vec4> ToVec4s(const std::vector<Vector3d>& vectors) {
  std::vector<Vec4> result;
  for (const Vector3d& v : vectors) result.push_back(ToVec4(v));
  result.push_back(Vec4{});
  return result;
}

// A cloth and the backend's data about it.
struct NearCloth {
  NearCloth(std::shared_ptr<const FloatModel> its_model, const Scene& scene)
      : model(std::move(its_model)),
        parameters(scene.parameters),
        controls(*model, parameters, false),
        state{ToVec4s(scene.state.positions_m), ToVec4s(scene.state.velocities_m_per_s)} {
    for (const uint32_t pin : model->pins) pin_targets.push_back(state.positions[pin]);
  }

  StepContext Context(StepScratch& scratch, bool leaves_out_colliders) const {
    return {*model,
            controls,
            {model->pins, pin_targets, model->free_particles, model->inverse_masses},
            nullptr,
            parameters.collider_motions,
            scratch,
            *alone,
            parameters.settings.max_iterations,
            leaves_out_colliders};
  }
  void End(const StepReport& report) {
    reports.push_back(report);
    if (report.fault != FaultReason::kNone) return;
    for (RigidMotion& motion : parameters.collider_motions) {
      motion = motion.After(parameters.settings.time_step_s);
    }
  }

  std::shared_ptr<const FloatModel> model;
  ClothParameters parameters = test::PlainParameters();
  FloatControls controls;
  FloatState state;
  std::vector<Vec4> pin_targets;
  std::vector<StepReport> reports;  // of every step
  std::unique_ptr<StepTeam> alone = std::make_unique<StepTeam>(1);
};

// Counts that show that a play tested its subject.
struct Counts {
  uint32_t far_steps = 0;  // that left out a collider
  uint64_t repeats = 0;
};

NearCloth PlayAlone(const Scene& scene, uint32_t steps, bool leaves_out_colliders, Counts& counts) {
  NearCloth cloth(std::make_shared<FloatModel>(scene.model), scene);
  StepScratch scratch;
  for (uint32_t k = 0; k < steps; ++k) {
    cloth.End(StepCloth(cloth.Context(scratch, leaves_out_colliders), true, cloth.state));
    counts.far_steps += scratch.reach.has_far ? 1 : 0;
  }
  counts.repeats += scratch.repeats;
  return cloth;
}

std::vector<NearCloth> PlayTogether(const std::vector<Scene>& scenes, uint32_t steps,
                                    Counts& counts) {
  const auto model = std::make_shared<FloatModel>(scenes[0].model);
  std::vector<NearCloth> cloths;
  for (const Scene& scene : scenes) cloths.emplace_back(model, scene);
  StepScratch single;
  GroupScratch lanes;
  for (uint32_t k = 0; k < steps; ++k) {
    std::vector<GroupCloth> group;
    for (NearCloth& cloth : cloths)
      group.push_back({cloth.Context(single, true), true, cloth.state});
    StepCloths(group, lanes);
    for (size_t lane = 0; lane < cloths.size(); ++lane) cloths[lane].End(group[lane].report);
    counts.far_steps += lanes.reaches[0].has_far ? 1 : 0;
  }
  counts.repeats += lanes.repeats;
  return cloths;
}

bool SameBits(const std::vector<Vec4>& a, const std::vector<Vec4>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec4)) == 0;
}

void ExpectSame(const NearCloth& actual, const NearCloth& expected, const std::string& where) {
  EXPECT_TRUE(SameBits(actual.state.positions, expected.state.positions)) << where;
  EXPECT_TRUE(SameBits(actual.state.velocities, expected.state.velocities)) << where;
  ASSERT_EQ(actual.reports.size(), expected.reports.size());
  for (size_t k = 0; k < actual.reports.size(); ++k) {
    EXPECT_EQ(test::DifferenceOf(actual.reports[k], expected.reports[k]), "")
        << where << ", step " << k;
  }
}

class ColliderReachTest : public testing::TestWithParam<test::ReachCase> {};
INSTANTIATE_TEST_SUITE_P(Scenes, ColliderReachTest, testing::ValuesIn(test::ReachCases(9, 8)),
                         [](const auto& one) { return one.param.scene.name; });

TEST_P(ColliderReachTest, AloneTheBitsAreThoseOfAllColliders) {
  const test::ReachCase& one = GetParam();
  Counts counts, of_all;
  const NearCloth cloth = PlayAlone(one.scene, one.steps, true, counts);
  const NearCloth expected = PlayAlone(one.scene, one.steps, false, of_all);
  ExpectSame(cloth, expected, one.scene.name);
  EXPECT_EQ(of_all.far_steps + of_all.repeats, 0u);
  EXPECT_GT(counts.far_steps + counts.repeats, 0u);
  Scene empty = one.scene;
  empty.parameters.colliders = {test::Wall(1e4)};
  empty.parameters.collider_motions.clear();
  const NearCloth alone = PlayAlone(empty, one.steps, false, of_all);
  EXPECT_EQ(!SameBits(alone.state.velocities, expected.state.velocities), one.meets);
  EXPECT_EQ(counts.repeats > 0, one.repeats) << counts.repeats;
}

// Several cloths, each higher than the last; of the burst ones only one is squeezed.
TEST_P(ColliderReachTest, InLanesTheBitsAreThoseOfAllCollidersAlone) {
  const test::ReachCase& one = GetParam();
  if (!one.fits_lanes) return;
  std::vector<Scene> scenes;
  for (uint32_t k = 0; k < std::min(6u, SupportedLanes().lane_count); ++k) {
    scenes.push_back(one.scene);
    Scene& scene = scenes.back();
    if (one.repeats && k != 2) scene.state = test::RestState(*scene.model);
    const Vector3d way(one.repeats && k != 2 ? -1 : 0, 0.03 * k, 0);
    for (Vector3d& p : scene.state.positions_m) p += way;
    scene.parameters.gravity_m_per_s2.x() = 0.1 * k;
  }
  Counts counts, of_all;
  const std::vector<NearCloth> cloths = PlayTogether(scenes, one.steps, counts);
  for (size_t k = 0; k < scenes.size(); ++k) {
    ExpectSame(cloths[k], PlayAlone(scenes[k], one.steps, false, of_all),
               one.scene.name + " " + std::to_string(k));
  }
  EXPECT_GT(counts.far_steps + counts.repeats, 0u);
  EXPECT_EQ(counts.repeats > 0, one.repeats) << counts.repeats;
}

// The check that particles stay in their range, alone.
struct Look {
  std::string name;
  uint32_t sweeps;
  void (*function)(const StepContext& context);
};
const Look kLooks[] = {
    {"integrate", 1, [](const StepContext& context) { Integrate(context); }},
    {"sweep", 2, [](const StepContext& context) { SolveContacts(context); }},
};

TEST(ReachWatchTest, OneParticleThatLeavesItsRangeIsNoticed) {
  Scene scene = test::ReachSheet("sheet", Preset::kRealtime, 9, 8);
  scene.parameters.colliders = {test::Wall(30)};
  const NearCloth cloth(std::make_shared<FloatModel>(scene.model), scene);
  StepScratch scratch;
  for (const Look& look : kLooks) {
    for (const float speed : {0.0f, 1e4f, std::numeric_limits<float>::quiet_NaN()}) {
      for (const uint32_t i : {0u, 40u, cloth.model->particle_count - 1}) {
        StepContext context = cloth.Context(scratch, true);
        context.max_iterations = look.sweeps;
        context.substep = FloatSubstep(cloth.controls.plan.schedule[0], 0);
        FindReach(context, cloth.state, scratch.reach);
        ASSERT_TRUE(scratch.reach.has_far);
        scratch.state = cloth.state;
        scratch.state.velocities[i][1] = speed;
        look.function(context);
        EXPECT_EQ(scratch.reach.has_left, speed != 0) << look.name << " " << i << " " << speed;
      }
    }
  }
}

// Places and motions of all sizes.
class AnyScene {
 public:
  explicit AnyScene(uint32_t seed) : random_(seed) {
    size_m_ = std::pow(10, Between(-1, 3));
    scene_ = test::SizedCloth(9, false);
    for (Vector3d& p : scene_.state.positions_m) p = Place();
    for (Vector3d& v : scene_.state.velocities_m_per_s) v = Place();
    auto kinds = test::EveryKind(0);
    Collider collider = kinds[seed / 2 % kinds.size()].second;
    RigidMotion motion = RigidMotion::AtRest(CentreOf(collider));
    motion.position_m = 2 * Place();
    motion.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(Between(0, 6), Place().normalized()));
    scene_.parameters.colliders = {Moved(collider, motion)};
    if (seed % 2 == 0) return;
    motion = RigidMotion::AtRest(CentreOf(scene_.parameters.colliders[0]));
    motion.velocity_m_per_s = Place();
    motion.angular_velocity_rad_per_s = Place() / size_m_;
    scene_.parameters.collider_motions = {motion};
  }

  const Scene& scene() const { return scene_; }
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

 private:
  Vector3d Place() { return size_m_ * Vector3d(Between(-1, 1), Between(-1, 1), Between(-1, 1)); }

  std::mt19937 random_;
  Scene scene_;
  double size_m_;
};

// The least gap of many places in the range at many times within the step, as the step computes it.
float LeastGap(AnyScene& any, const StepContext& context, const ParticleBox& range) {
  float least = std::numeric_limits<float>::infinity();
  for (uint32_t k = 0; k < 300; ++k) {
    Vec4 place{};
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double share = k < 8 ? k >> axis & 1 : any.Between(0, 1);
      place[axis] =
          static_cast<float>(range.low[axis] + share * (range.high[axis] - range.low[axis]));
    }
    const FloatCollider& collider = context.controls.colliders[0];
    if (context.collider_motions.empty()) {
      least = std::min(least, RestingSurface(collider).GapAtStart(place).gap);
      continue;
    }
    const double time_s = k % 3 == 0 ? context.controls.time_step : any.Between(0, 1.0 / 60);
    const MovingSurface surface(collider, context.collider_motions[0].After(time_s));
    least = std::min(least, surface.GapAtEnd(place).gap);
  }
  return least;
}

TEST(AddNearTest, NothingInTheRangeTouchesWhatIsLeftOut) {
  uint32_t far = 0;
  for (uint32_t seed = 0; seed < 2000; ++seed) {
    AnyScene any(seed);
    const NearCloth cloth(std::make_shared<FloatModel>(any.scene().model), any.scene());
    StepScratch scratch;
    const StepContext context = cloth.Context(scratch, true);
    std::vector<uint32_t> near;
    const ParticleBox range = AddNear(context, cloth.state, near);
    if (!near.empty()) continue;
    ++far;
    EXPECT_GT(LeastGap(any, context, range), 0) << seed;
  }
  EXPECT_GT(far, 300u);
}

// A collider is left out beyond twice the way that gravity allows within the step, 5 mm, plus 1 %
// of the length scale, 1 mm; the box of a map is larger than its mesh by three cells of 7 cm, and
// here it is turned.
TEST(AddNearTest, CollidersBelowASheetAreLeftOutBeyondItsReach) {
  for (const double top_m : {-0.005, -0.03, -0.4}) {
    for (const auto& [kind, collider] : test::EveryKind(top_m)) {
      Scene scene = test::ReachSheet(kind, Preset::kRealtime, 9, 8);
      scene.parameters.colliders = {collider};
      const NearCloth cloth(std::make_shared<FloatModel>(scene.model), scene);
      StepScratch scratch;
      std::vector<uint32_t> near;
      AddNear(cloth.Context(scratch, true), cloth.state, near);
      EXPECT_EQ(near.empty(), top_m < (kind == "map" ? -0.03 : -0.005)) << kind << " at " << top_m;
    }
  }
}

}  // namespace
}  // namespace drape::cpu
