// The result of a cloth is the same bit for bit, whatever is stepped with it and whatever slot it
// has.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

constexpr uint32_t kSteps = 2;

Scene PaperSheet() {
  Scene scene = SizedCloth(1024);
  scene.parameters.settings = PresetSettings(Preset::kPaper);
  Stir(scene, 0.5);
  return scene;
}

// Together they run every part of the step, and every size class of a backend.
std::vector<Scene> Subjects() {
  Scene sheet = SizedCloth(33);
  Stir(sheet, 0.5);
  sheet.parameters.settings.refine_above_strain = 1e-5;
  Scene sphere = FallingOnSphere(16);
  for (auto& v : sphere.state.velocities_m_per_s) v.y() = -3;
  Scene pushed = FallingOnSphere(10);
  pushed.parameters.restitution = 0.5;
  for (const Collider& collider : pushed.parameters.colliders) {
    pushed.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  pushed.parameters.collider_motions[0].velocity_m_per_s = {0, 3, 0.5};
  pushed.parameters.collider_motions[0].angular_velocity_rad_per_s = {0, 5, 0};
  Scene windy = SizedCloth(255);
  windy.parameters.wind_m_per_s = {1, 3, 2};
  windy.parameters.air_drag = windy.parameters.air_lift = 1;
  Scene fabric =
      Grid(12, 9, 0.5, 0.5, {0}, {.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20});
  Stir(fabric, 0.5);
  Scene large = SizedCloth(5000);
  large.parameters.air_drag = 1;
  Stir(large, 0.2);
  large.parameters.settings.substeps = 4;
  large.parameters.settings.refine_above_strain = 1e-5;
  Scene compliant = CompliantSheet(9, 1e-5);
  compliant.parameters.damping_per_s = 0.3;
  Stir(compliant, 0.5);
  Scene on_map = FallingOnDistanceMap(14);
  for (auto& v : on_map.state.velocities_m_per_s) v.y() = -3;
  return {SizedCloth(1), sheet, PaperSheet(), sphere, pushed,
          compliant,     windy, fabric,       large,  on_map};
}

// A sheet that touches itself: folded in four, falling.
Scene SelfTouching() {
  Scene scene = Grid(20, 12, 0.6, 0.4);
  for (Eigen::Vector3d& p : scene.state.positions_m) {
    const double phase = p.x() / 0.6 * 2 * 3.14159265358979;
    p = {0.2 * std::sin(phase) + 0.02 * p.x(), 0.005 * std::cos(phase) + 0.01 * p.x(), p.z()};
  }
  Stir(scene, 2);
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  scene.parameters.self_collision.emplace().thickness_m = 0.004;
  return scene;
}

std::vector<Scene> Neighbours() {
  Scene falling = FallingOnSphere(9);
  return {SizedCloth(2), ExplosiveSheet(6), SizedCloth(1025),
          falling,       SizedCloth(31),    FallingOnDistanceMap(9)};
}

// Cloths of one backend that are stepped together; destroys them at the end.
class Batch {
 public:
  explicit Batch(Backend& backend) : backend_(backend) {}
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  ~Batch() {
    for (const StepItem& item : items_) backend_.Destroy(item.cloth);
  }

  ClothHandle Add(const Scene& scene, bool measure = false) {
    items_.push_back({CreateCloth(backend_, scene), scene.pin_targets_m, measure});
    return items_.back().cloth;
  }

  BatchReport Step() {
    BatchReport report;
    for (uint32_t step = 0; step < kSteps; ++step) report = backend_.Step(items_);
    return report;
  }

 private:
  Backend& backend_;
  std::vector<StepItem> items_;
};

std::string BitsAlone(Backend& backend, const Scene& scene, bool measure = false) {
  Batch batch(backend);
  const ClothHandle cloth = batch.Add(scene, measure);
  batch.Step();
  return ReadBits(backend, cloth);
}

// Not EXPECT_EQ, which would print the bytes of the states.
void ExpectSameBits(const std::string& actual, const std::string& expected,
                    const std::string& where) {
  ASSERT_EQ(actual.size(), expected.size()) << where;
  size_t k = 0;
  while (k < actual.size() && actual[k] == expected[k]) ++k;
  EXPECT_EQ(k, actual.size()) << where << ": byte " << k << " differs";
}

class BitExactnessTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, BitExactnessTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(ReductionLong, BitExactnessTest, testing::Values("gl_reduction"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(BitExactnessTest, AStepChangesTheState) {
  Backend& backend = SharedBackend(GetParam());
  for (const Scene& scene : Subjects()) {
    const ClothHandle cloth = CreateCloth(backend, scene);
    const std::string before = ReadBits(backend, cloth);
    StepAlone(backend, cloth, scene);
    EXPECT_NE(ReadBits(backend, cloth), before) << scene.name;
    backend.Destroy(cloth);
  }
}

// Every subject is in each batch, at other places among other cloths: first, last, in the middle.
TEST_P(BitExactnessTest, SameInAnyPlaceOfABatch) {
  Backend& backend = SharedBackend(GetParam());
  std::vector<Scene> scenes = Subjects();
  const size_t subject_count = scenes.size();
  for (Scene& neighbour : Neighbours()) scenes.push_back(std::move(neighbour));
  std::vector<std::string> alone;
  for (size_t k = 0; k < subject_count; ++k) alone.push_back(BitsAlone(backend, scenes[k]));
  // Steps that share no factor with the count visit every cloth once.
  ASSERT_EQ(scenes.size(), 16u);
  for (const size_t stride : {1, 5, 15}) {
    Batch batch(backend);
    std::vector<ClothHandle> cloths(scenes.size());
    for (size_t place = 0; place < scenes.size(); ++place) {
      const size_t k = (place + 1) * stride % scenes.size();
      cloths[k] = batch.Add(scenes[k]);
    }
    const BatchReport report = batch.Step();
    size_t faulted = 0;
    for (const StepReport& one : report.reports) faulted += one.fault != FaultReason::kNone;
    EXPECT_EQ(faulted, 1u) << "exactly the explosive neighbour must blow up";
    for (size_t k = 0; k < subject_count; ++k) {
      ExpectSameBits(ReadBits(backend, cloths[k]), alone[k],
                     scenes[k].name + " in the batch of stride " + std::to_string(stride));
    }
  }
}

TEST_P(BitExactnessTest, SameAmongEqualCloths) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = PaperSheet();
  const std::string alone = BitsAlone(backend, scene);
  Batch batch(backend);
  std::vector<ClothHandle> cloths;
  for (int k = 0; k < 5; ++k) cloths.push_back(batch.Add(scene));
  batch.Step();
  for (const ClothHandle& cloth : cloths) {
    ExpectSameBits(ReadBits(backend, cloth), alone, "one of five equal cloths");
  }
}

TEST_P(BitExactnessTest, SameWhetherMeasuredOrNot) {
  Backend& backend = SharedBackend(GetParam());
  for (const Scene& scene : Subjects()) {
    ExpectSameBits(BitsAlone(backend, scene, true), BitsAlone(backend, scene, false), scene.name);
  }
}

TEST_P(BitExactnessTest, SameInAReusedSlot) {
  Backend& backend = SharedBackend(GetParam());
  for (const Scene& scene : Subjects()) {
    const std::string alone = BitsAlone(backend, scene);
    std::vector<ClothHandle> cloths;
    for (const Scene& neighbour : Neighbours()) {
      cloths.push_back(CreateCloth(backend, neighbour));
      StepAlone(backend, cloths.back(), neighbour);
    }
    backend.Destroy(cloths[1]);  // the explosive one: its slot holds the worst left-overs
    backend.Destroy(cloths[3]);
    ExpectSameBits(BitsAlone(backend, scene), alone, scene.name);
    for (const size_t k : {0, 2, 4}) backend.Destroy(cloths[k]);
  }
}

TEST_P(BitExactnessTest, SameOnAFreshBackend) {
  const Scene scene = PaperSheet();
  const std::string first = BitsAlone(SharedBackend(GetParam()), scene);
  const std::unique_ptr<Backend> fresh = MakeBackend(GetParam());
  ExpectSameBits(BitsAlone(*fresh, scene), first, "a second backend");
}

// Reading a state and writing it back changes nothing; snapshots will rely on this.
TEST_P(BitExactnessTest, SameAfterReadAndWrite) {
  Backend& backend = SharedBackend(GetParam());
  for (const Scene& scene : Subjects()) {
    const std::string uninterrupted = BitsAlone(backend, scene);
    const ClothHandle first = CreateCloth(backend, scene);
    StepAlone(backend, first, scene, kSteps - 1);
    ClothUpdate update;
    update.state = ReadState(backend, first);
    backend.Destroy(first);
    const ClothHandle second = CreateCloth(backend, scene);
    // The poses of colliders are not part of the particles' state.
    std::vector<RigidMotion> motions = scene.parameters.collider_motions;
    for (RigidMotion& motion : motions) {
      for (uint32_t step = 1; step < kSteps; ++step) {
        motion = motion.After(scene.parameters.settings.time_step_s);
      }
    }
    update.collider_motions = motions;
    ASSERT_TRUE(backend.Write(second, update).ok());
    StepAlone(backend, second, scene);
    ExpectSameBits(ReadBits(backend, second), uninterrupted, scene.name);
    backend.Destroy(second);
  }
}

TEST(CpuBitExactnessTest, SameWithAnyNumberOfThreads) {
  std::vector<std::string> expected;
  for (const uint32_t thread_count : {1u, 2u, 4u}) {
    const std::unique_ptr<Backend> backend = CreateCpuBackend({thread_count});
    Batch batch(*backend);
    std::vector<ClothHandle> cloths;
    for (int copy = 0; copy < 3; ++copy) {
      for (const Scene& scene : Subjects()) cloths.push_back(batch.Add(scene));
      for (const Scene& scene : Neighbours()) cloths.push_back(batch.Add(scene));
    }
    batch.Step();
    std::vector<std::string> bits;
    for (const ClothHandle& cloth : cloths) bits.push_back(ReadBits(*backend, cloth));
    if (expected.empty()) expected = bits;
    for (size_t k = 0; k < bits.size(); ++k) {
      ExpectSameBits(bits[k], expected[k],
                     "cloth " + std::to_string(k) + ", threads " + std::to_string(thread_count));
    }
  }
}

// In a batch of its own a big cloth has all threads from the start.
TEST(CpuBitExactnessTest, ABigClothAloneIsSameWithAnyNumberOfThreads) {
  for (Scene scene : {SizedCloth(5000), FallingOnSphere(70)}) {
    Stir(scene, 0.5);
    for (auto& v : scene.state.velocities_m_per_s) v.y() -= 3;
    const std::string one_thread = BitsAlone(*CreateCpuBackend({1}), scene);
    for (const uint32_t thread_count : {2u, 4u}) {
      ExpectSameBits(BitsAlone(*CreateCpuBackend({thread_count}), scene), one_thread, scene.name);
    }
  }
}

// The frame budget relies on this: a cap for one step is the setting for that step, and leaves the
// next one unchanged.
TEST_P(BitExactnessTest, ACapOnSweepsIsThatSetting) {
  for (Scene scene : {PaperSheet(), SizedCloth(1500)}) {
    scene.parameters.settings.max_iterations = 9;
    scene.parameters.settings.tolerance = 0;
    scene.parameters.settings.substeps = 2;
    Stir(scene, 0.5);
    Backend& backend = SharedBackend(GetParam());
    const ClothHandle capped = CreateCloth(backend, scene);
    const ClothHandle set = CreateCloth(backend, scene);
    for (const uint32_t cap : {3u, 0u, 1u, 20u}) {
      ClothUpdate update;
      update.parameters = scene.parameters;
      if (cap > 0) update.parameters->settings.max_iterations = std::min(cap, 9u);
      ASSERT_TRUE(backend.Write(set, update).ok());
      const StepItem item{
          .cloth = capped, .pin_targets_m = {}, .measure = false, .max_iterations = cap};
      const StepReport report = backend.Step({&item, 1}).reports.at(0);
      EXPECT_EQ(report.iterations, StepAlone(backend, set, scene).iterations);
      EXPECT_EQ(ReadBits(backend, capped), ReadBits(backend, set)) << "cap " << cap;
    }
    backend.Destroy(capped);
    backend.Destroy(set);
  }
}

// Alone, among others, and measured. Of gl: tests/gl_compute/self_contacts_test.cpp.
TEST(SelfTouchingBits, DoNotDependOnTheBatch) {
  for (const std::string name : {"reference", "cpu"}) {
    const std::unique_ptr<Backend> backend = MakeBackend(name);
    const std::string alone = BitsAlone(*backend, SelfTouching());
    ExpectSameBits(BitsAlone(*backend, SelfTouching(), true), alone, name + ", measured");
    Batch batch(*backend);
    for (const Scene& scene : Neighbours()) batch.Add(scene);
    const ClothHandle first = batch.Add(SelfTouching());
    for (const Scene& scene : Neighbours()) batch.Add(scene);
    const ClothHandle second = batch.Add(SelfTouching(), true);
    const BatchReport report = batch.Step();
    ExpectSameBits(ReadBits(*backend, first), alone, name);
    ExpectSameBits(ReadBits(*backend, second), alone, name);
    EXPECT_GT(report.reports.back().measured.near_pairs, 0u) << "it does not touch itself";
  }
}

}  // namespace
}  // namespace drape::test
