// Leaving out colliders that a cloth cannot meet within a step changes nothing, to the bit, under
// any plan.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/support/reach_scenes.h"
#include "tests/support/reports.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using test::Scene;

// A device with colliders left out or not, and how many were, of all batches together.
struct Device {
  explicit Device(GlTuning tuning) {
    tuning.on_left_out = [this](uint32_t count) { left_out += count; };
    Result<std::unique_ptr<Backend>> created = CreateTunedGlBackend({}, tuning);
    DRAPE_CHECK(created.ok(), created.status().ToString());
    backend = std::move(created).value();
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  std::unique_ptr<Backend> backend;
  uint64_t left_out = 0;
};

// How the steps of a test are computed.
struct Way {
  std::string name;
  bool is_tiled = false;
  uint32_t loop_budget = 0;
  uint32_t local_size = 0;
};

const Way kResident{.name = "resident"};
const Way kInParts{.name = "in_parts", .loop_budget = 3000};
const Way kNarrow{.name = "narrow", .local_size = 4};
const Way kTiled{.name = "tiled", .is_tiled = true};

// Never destroyed: a device must not be destroyed after the libraries that it needs.
Device& DeviceFor(const Way& way, bool leaves_out) {
  static auto& devices = *new std::vector<std::pair<std::string, std::unique_ptr<Device>>>;
  const std::string name = way.name + (leaves_out ? "" : " all");
  for (const auto& [known, device] : devices) {
    if (known == name) return *device;
  }
  GlTuning tuning;
  tuning.local_size = way.local_size;
  tuning.loop_budget = way.loop_budget;
  tuning.leave_out_colliders = leaves_out;
  devices.emplace_back(name, std::make_unique<Device>(tuning));
  return *devices.back().second;
}

struct Played {
  std::string bits;
  std::vector<StepReport> reports;  // of every step
  uint64_t left_out = 0;            // colliders, of all steps together
  uint32_t dispatch_count = 0;      // of the last step
};

Played Play(const Scene& scene, uint32_t steps, const Way& way, bool leaves_out) {
  Device& device = DeviceFor(way, leaves_out);
  const uint64_t before = device.left_out;
  const ClothHandle cloth = CreateCloth(*device.backend, scene);
  const StepItem item{.cloth = cloth,
                      .pin_targets_m = scene.pin_targets_m,
                      .measure = true,
                      .rest_lengths_m = scene.rest_length_targets_m};
  Played played;
  for (uint32_t k = 0; k < steps; ++k) {
    const BatchReport report = device.backend->Step({&item, 1});
    played.reports.push_back(report.reports.at(0));
    played.dispatch_count = report.dispatch_count;
  }
  played.bits = test::ReadBits(*device.backend, cloth);
  played.left_out = device.left_out - before;
  device.backend->Destroy(cloth);
  return played;
}

void ExpectSame(const Played& actual, const Played& expected, const std::string& where) {
  EXPECT_TRUE(actual.bits == expected.bits) << where;
  ASSERT_EQ(actual.reports.size(), expected.reports.size());
  for (size_t k = 0; k < actual.reports.size(); ++k) {
    EXPECT_EQ(test::DifferenceOf(actual.reports[k], expected.reports[k]), "")
        << where << ", step " << k;
  }
}

struct PlannedCase {
  test::ReachCase one;
  Way way;
};
void PrintTo(const PlannedCase& planned, std::ostream* stream) {
  *stream << planned.way.name << ", " << planned.one.scene.name;
}

// Compiling takes the time of these tests: some scenes under every plan, some under one, all in the
// long tests.
bool IsShort(const std::string& scene, const Way& way) {
  static const std::set<std::string> kOfEveryPlan = {"fall_map_moving",
                                                     "burst_of_a_stiff_sheet_of_several_sweeps"};
  static const std::set<std::string> kResidentOnly = {"fall_sphere",
                                                      "fall_box_moving_paper",
                                                      "burst",
                                                      "floor_among_far_ones",
                                                      "fall_plane_paper",
                                                      "fall_capsule",
                                                      "fast_fall_box",
                                                      "fast_fall_map",
                                                      "hung_paper",
                                                      "moving_floor_among_far_ones",
                                                      "explosive_8",
                                                      "hung_bending",
                                                      "burst_at_two_walls_of_several_sweeps",
                                                      "burst_of_several_sweeps"};
  return kOfEveryPlan.contains(scene) ||
         (way.name == kResident.name && kResidentOnly.contains(scene));
}

std::vector<PlannedCase> PlannedCases(bool is_short) {
  std::vector<PlannedCase> cases;
  for (const Way& way : {kResident, kInParts, kTiled}) {
    for (test::ReachCase& one : way.is_tiled ? test::ReachCases(33, 32) : test::ReachCases(9, 8)) {
      if (IsShort(one.scene.name, way) != is_short) continue;
      StepSettings& settings = one.scene.parameters.settings;
      if (way.is_tiled) {
        settings.substeps = std::min(settings.substeps, 3u);
        settings.max_iterations = std::min(settings.max_iterations, 8u);
      }
      cases.push_back({std::move(one), way});
    }
  }
  return cases;
}

std::string NameOf(const testing::TestParamInfo<PlannedCase>& planned) {
  return planned.param.way.name + "_" + planned.param.one.scene.name;
}

// Puts all colliders where nothing meets them. Their shapes stay, so that the kernels do too.
void TakeAway(ClothParameters& parameters) {
  for (size_t k = 0; k < parameters.colliders.size(); ++k) {
    Collider& collider = parameters.colliders[k];
    RigidMotion motion = RigidMotion::AtRest(CentreOf(collider));
    motion.position_m.x() += 1e4;
    const bool is_plane = collider.kind() == ShapeKind::kPlane;
    collider = is_plane ? test::Wall(1e4) : Moved(collider, motion);
    if (parameters.collider_motions.empty()) continue;
    parameters.collider_motions[k] = RigidMotion::AtRest(CentreOf(collider));
  }
}

class GlColliderReachTest : public testing::TestWithParam<PlannedCase> {};
INSTANTIATE_TEST_SUITE_P(Some, GlColliderReachTest, testing::ValuesIn(PlannedCases(true)), NameOf);
INSTANTIATE_TEST_SUITE_P(OthersLong, GlColliderReachTest, testing::ValuesIn(PlannedCases(false)),
                         NameOf);

TEST_P(GlColliderReachTest, TheBitsAreThoseOfAllColliders) {
  const auto& [one, way] = GetParam();
  const Played played = Play(one.scene, one.steps, way, true);
  const Played expected = Play(one.scene, one.steps, way, false);
  ExpectSame(played, expected, one.scene.name);
  EXPECT_GT(played.left_out, 0u);
  EXPECT_EQ(expected.left_out, 0u);
  if (way.loop_budget != 0 && one.scene.parameters.settings.substeps > 8) {
    EXPECT_GT(played.dispatch_count, 2u);
  }
  Scene empty = one.scene;
  TakeAway(empty.parameters);
  EXPECT_EQ(Play(empty, one.steps, way, false).bits != expected.bits, one.meets);
}

// Driven lengths, which no estimate includes, push one end of a chain against a wall.
TEST(GlColliderReachWaysTest, DrivenLengthsReachFarColliders) {
  for (const Way& way : {kResident, kNarrow}) {
    Scene scene = test::Chain(8, 0.1, 0.01);
    scene.parameters.settings = PresetSettings(Preset::kAccurate);
    scene.parameters.settings.substeps = 8;
    scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.5;
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {test::Wall(30), test::Wall(0.9), test::Wall(0.95)};
    scene.rest_length_targets_m.assign(8, 0.15);
    std::vector<std::string> bits;
    for (const bool leaves_out : {true, false}) {
      Device& device = DeviceFor(way, leaves_out);
      const uint64_t before = device.left_out;
      const ClothHandle cloth = CreateCloth(*device.backend, scene);
      ClothUpdate own_lengths;
      own_lengths.rest_lengths_m = std::vector<double>(8, 0.1);
      ASSERT_TRUE(device.backend->Write(cloth, own_lengths).ok());
      StepAlone(*device.backend, cloth, scene);
      EXPECT_EQ(device.left_out - before, leaves_out ? 3u : 0u);
      const ParticleState state = test::ReadState(*device.backend, cloth);
      EXPECT_GT(state.positions_m[8].x(), 0.85);
      EXPECT_LT(state.positions_m[8].x(), 0.91) << "held by the wall";
      bits.push_back(test::ReadBits(*device.backend, cloth));
      device.backend->Destroy(cloth);
    }
    EXPECT_TRUE(bits[0] == bits[1]) << way.name;
  }
}

// All of them, before the sheet falls farther than the estimate of a step. These and the sheets
// below have the smallest kernels; those of other settings are among the scenes above.
TEST(GlColliderReachWaysTest, WhatIsOutOfReachIsLeftOut) {
  for (const Way& way : {kResident, kInParts, kNarrow, kTiled}) {
    Scene scene =
        test::ReachSheet("sheet", Preset::kPaper, way.is_tiled ? 33 : 9, way.is_tiled ? 32 : 8);
    scene.parameters.settings.substeps = way.is_tiled ? 2 : 30;
    const auto count = [&] { return Play(scene, 1, way, true).left_out; };
    const Collider floor = PlaneThrough({0, -0.001, 0}, {0, 1, 0});
    scene.parameters.colliders = {floor};
    EXPECT_EQ(count(), 0u) << way.name;
    scene.parameters.colliders = {test::Wall(30), floor, SphereAt({0.5, 8, 0.5}, 1)};
    EXPECT_EQ(count(), 2u) << way.name;
    // Colliders beyond the 24th are always tested.
    scene.parameters.colliders.assign(30, test::Wall(30));
    EXPECT_EQ(count(), 24u) << way.name;
    scene.parameters.colliders[20] = floor;
    EXPECT_EQ(count(), 23u) << way.name;
    scene.parameters.colliders[20] = test::Wall(30);
    scene.parameters.colliders[27] = {floor};
    const Played played = Play(scene, 3, way, true);
    EXPECT_EQ(played.left_out, 3 * 24u) << way.name;
    ExpectSame(played, Play(scene, 3, way, false), way.name);
  }
}

// No speed predicts the motion of pins: the wall is 10 cm away, and so are the targets.
TEST(GlColliderReachWaysTest, TheWaysOfPinsAreForeseen) {
  for (const Way& way : {kResident, kNarrow}) {
    Scene scene = test::Chain(8, 0.1, 0.01);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {test::Wall(0.9)};
    EXPECT_EQ(Play(scene, 1, way, true).left_out, 1u) << way.name;
    scene.pin_targets_m = {{0.1, 0, 0}};
    EXPECT_EQ(Play(scene, 1, way, true).left_out, 0u) << way.name;
  }
}

// A collider is left out beyond twice the way that gravity allows within the step, 5 mm, plus 1 %
// of the length scale, 1 mm; the box of a map is larger than its mesh by three cells of 7 cm, and
// here it is turned.
TEST(GlColliderReachWaysTest, CollidersBelowASheetAreLeftOutBeyondItsReach) {
  for (const double top_m : {-0.005, -0.03, -0.4}) {
    for (const auto& [kind, collider] : test::EveryKind(top_m)) {
      Scene scene = test::ReachSheet(kind, Preset::kPaper, 9, 8);
      scene.parameters.colliders = {collider};
      const bool is_far = top_m < (kind == "map" ? -0.03 : -0.005);
      EXPECT_EQ(Play(scene, 1, kResident, true).left_out, is_far ? 1u : 0u)
          << kind << " at " << top_m;
    }
  }
}

// Below a sheet that rests: one that comes 0.5 m per step, and a bar whose end turns up into it.
TEST(GlColliderReachWaysTest, TheWaysOfCollidersAreForeseen) {
  struct Coming {
    Collider collider;
    Vector3d velocity_m_per_s, angular_velocity_rad_per_s;
  };
  const Collider bar = BoxAt({-0.2, -0.4, 0.5}, {0.6, 0.05, 0.3}, Eigen::Quaterniond::Identity());
  for (const auto& [collider, velocity_m_per_s, angular_velocity_rad_per_s] :
       {Coming{SphereAt({0.5, -0.7, 0.5}, 0.3), {0, 30, 0}, {0, 0, 0}},
        Coming{bar, {0, 0, 0}, {0, 0, 60}}}) {
    Scene scene = test::ReachSheet("sheet", Preset::kPaper, 9, 8);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {collider};
    scene.parameters.collider_motions = {RigidMotion::AtRest(CentreOf(collider))};
    const Played resting = Play(scene, 1, kResident, true);
    EXPECT_EQ(resting.left_out, 1u);
    RigidMotion& motion = scene.parameters.collider_motions[0];
    motion.velocity_m_per_s = velocity_m_per_s;
    motion.angular_velocity_rad_per_s = angular_velocity_rad_per_s;
    const Played played = Play(scene, 1, kResident, true);
    EXPECT_EQ(played.left_out, 0u);
    ExpectSame(played, Play(scene, 1, kResident, false), "coming");
    EXPECT_TRUE(played.bits != resting.bits) << "it is met";
  }
}

// Loose particles at places and speeds of all sizes, beside one collider, at rest or moving.
class LooseScene {
 public:
  explicit LooseScene(uint32_t seed) : random_(seed) {
    size_m_ = std::pow(10, Between(-1, 3));
    ParticleTopology loose;
    for (uint32_t i = 0; i < 40; ++i) {
      loose.positions_m.push_back(0.2 * Place());
      loose.masses_kg.push_back(0.1);
    }
    scene_ = test::Particles(loose);
    scene_.parameters.settings.substeps = 4;
    for (Vector3d& v : scene_.state.velocities_m_per_s) v = Between(0, 3) * Place();
    auto kinds = test::EveryKind(0);
    Collider collider = kinds[seed / 2 % kinds.size()].second;
    RigidMotion motion = RigidMotion::AtRest(CentreOf(collider));
    motion.position_m = Place();
    motion.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(Between(0, 6), Place().normalized()));
    scene_.parameters.colliders = {Moved(collider, motion)};
    if (seed % 2 == 0) return;
    motion = RigidMotion::AtRest(CentreOf(scene_.parameters.colliders[0]));
    motion.velocity_m_per_s = 10 * Place();
    motion.angular_velocity_rad_per_s = 10 * Place() / size_m_;
    scene_.parameters.collider_motions = {motion};
  }
  const Scene& scene() const { return scene_; }

 private:
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d Place() { return size_m_ * Vector3d(Between(-1, 1), Between(-1, 1), Between(-1, 1)); }

  std::mt19937 random_;
  Scene scene_;
  double size_m_ = 1;
};

TEST(GlColliderReachWaysLong, LooseParticlesOfAllSizes) {
  uint32_t far = 0, met = 0;
  for (uint32_t seed = 0; seed < 400; ++seed) {
    const LooseScene any(seed);
    const Played played = Play(any.scene(), 3, kResident, true);
    const Played expected = Play(any.scene(), 3, kResident, false);
    ExpectSame(played, expected, std::to_string(seed));
    far += played.left_out > 0 ? 1 : 0;
    met += expected.reports.back().measured.contacts > 0 ? 1 : 0;
  }
  EXPECT_GT(far, 60u);
  EXPECT_GT(met, 60u);
}

}  // namespace
}  // namespace drape
