// A step in pieces has the bits of a step at once, whatever happens to others between its pieces,
// and leaves nothing behind when it is dropped.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

constexpr uint32_t kSteps = 2;

// Tolerances, velocity sweeps, contacts, moving colliders, a step that is done again with all
// colliders (the sphere is out of reach at first), teams (5000 particles), both plans of gl.
std::vector<Scene> Subjects() {
  Scene sheet = SizedCloth(33);
  Stir(sheet, 0.5);
  sheet.parameters.settings.refine_above_strain = 1e-5;
  Scene paper = SizedCloth(1024);
  paper.parameters.settings = PresetSettings(Preset::kPaper);
  Stir(paper, 0.5);
  Scene accurate = SizedCloth(31);
  accurate.parameters.settings = PresetSettings(Preset::kAccurate);
  Stir(accurate, 0.2);
  Scene velocities = SizedCloth(40);
  velocities.parameters.settings.integration = Integration::kOneStep;
  velocities.parameters.settings.velocity_iterations = 3;
  Stir(velocities, 0.5);
  Scene pushed = FallingOnSphere(10);
  for (auto& v : pushed.state.velocities_m_per_s) v.y() = -3;
  for (const Collider& collider : pushed.parameters.colliders) {
    pushed.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  pushed.parameters.collider_motions[0].velocity_m_per_s = {0, 3, 0.5};
  Scene fabric =
      Grid(12, 9, 0.5, 0.5, {0}, {.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20});
  Stir(fabric, 0.5);
  Scene hinges =
      MeshedGrid(33, 33, 1, 1, {0}, {.bending_rigidity_n_m = 1e-6});  // that share forces
  Stir(hinges, 0.3);
  Scene large = SizedCloth(5000);
  large.parameters.air_drag = 1;
  Stir(large, 0.2);
  large.parameters.settings.substeps = 4;
  large.parameters.settings.max_iterations = 5;
  large.parameters.settings.tolerance = 1e-3;
  Scene on_map = FallingOnDistanceMap(14);
  for (auto& v : on_map.state.velocities_m_per_s) v.y() = -3;
  // Several parts of gl's resident plan.
  Scene many_sweeps = SizedCloth(64);
  many_sweeps.parameters.settings.sweep = Sweep::kColours;
  many_sweeps.parameters.settings.substeps = 80;
  many_sweeps.parameters.settings.max_iterations = 80;
  Stir(many_sweeps, 0.2);
  return {sheet, paper, accurate, velocities, pushed, fabric, hinges, large, on_map, many_sweeps};
}

// A dispatch cannot pause, and a resident step is one if it is short; on hardware, whose dispatches
// may be long, almost any.
bool MustPause(const Backend& backend, const Scene& scene) {
  const StepSettings& settings = scene.parameters.settings;
  const BackendDescription description = backend.Describe();
  const bool is_long = settings.substeps * settings.max_iterations >= 6000;
  return description.plan_of(*scene.model, scene.parameters) != "resident" ||
         (is_long && !description.is_hardware_gpu);
}

class StepPieces : public testing::TestWithParam<std::string> {
 protected:
  // Pauses wherever that is possible. Between the pieces the neighbour takes a step: after every
  // sixteenth of the first, and then ever more rarely, for some steps pause 40 000 times.
  BatchReport StepInPieces(const StepItem& item) {
    for (;;) {
      auto report = backend_.StepPiece({&item, 1}, Pause::At({}));
      if (report.has_value()) return *std::move(report);
      ++pauses_;
      const bool is_early = pauses_ < 256 && pauses_ % 16 == 1;
      if (is_early || std::has_single_bit(static_cast<uint32_t>(pauses_))) {
        StepAlone(backend_, neighbour_, neighbour_scene_);
      }
    }
  }

  Backend& backend_ = SharedBackend(GetParam());
  const Scene neighbour_scene_ = SizedCloth(64);
  const ClothHandle neighbour_ = CreateCloth(backend_, neighbour_scene_);
  int pauses_ = 0;
};
INSTANTIATE_TEST_SUITE_P(Backends, StepPieces, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(StepPieces, HaveTheBitsOfOneStep) {
  for (const Scene& scene : Subjects()) {
    const ClothHandle whole = CreateCloth(backend_, scene);
    const ClothHandle pieces = CreateCloth(backend_, scene);
    for (uint32_t step = 0; step < kSteps; ++step) {
      const StepItem at_once{whole, scene.pin_targets_m, true};
      const StepReport expected = backend_.Step({&at_once, 1}).reports[0];
      pauses_ = 0;
      const StepReport report = StepInPieces({pieces, scene.pin_targets_m, true}).reports[0];
      EXPECT_EQ(report.iterations, expected.iterations) << scene.name;
      EXPECT_EQ(report.converged, expected.converged) << scene.name;
      EXPECT_EQ(report.measured.max_strain, expected.measured.max_strain) << scene.name;
      EXPECT_EQ(report.measured.kinetic_energy_j, expected.measured.kinetic_energy_j);
      if (MustPause(backend_, scene)) {
        EXPECT_GT(pauses_, 1) << scene.name;
      }
    }
    EXPECT_TRUE(ReadBits(backend_, pieces) == ReadBits(backend_, whole)) << scene.name;
    backend_.Destroy(whole);
    backend_.Destroy(pieces);
  }
  backend_.Destroy(neighbour_);
}

// A sweep of a large cloth may take longer than a batch of others.
TEST_P(StepPieces, EndWithinASweep) {
  Scene scene = SizedCloth(5000);
  Stir(scene, 0.2);
  scene.parameters.settings.substeps = 1;
  scene.parameters.settings.max_iterations = 1;
  const ClothHandle whole = CreateCloth(backend_, scene);
  const ClothHandle pieces = CreateCloth(backend_, scene);
  StepAlone(backend_, whole, scene);
  StepInPieces({pieces, scene.pin_targets_m});
  // On the cpu all cores share a sweep, which is short.
  if (GetParam() != "cpu") {
    EXPECT_GT(pauses_, 0);
  }
  EXPECT_TRUE(ReadBits(backend_, pieces) == ReadBits(backend_, whole));
  for (const ClothHandle cloth : {whole, pieces, neighbour_}) backend_.Destroy(cloth);
}

TEST_P(StepPieces, ADroppedStepLeavesNothingBehind) {
  enum class Dropped { kAbandoned, kByStep, kByWrite };
  for (const Scene& scene : Subjects()) {
    if (!MustPause(backend_, scene)) continue;
    for (const Dropped how : {Dropped::kAbandoned, Dropped::kByStep, Dropped::kByWrite}) {
      const ClothHandle plain = CreateCloth(backend_, scene);
      const ClothHandle dropped = CreateCloth(backend_, scene);
      const std::string before = ReadBits(backend_, dropped);
      const StepItem item{dropped, scene.pin_targets_m, true};
      ASSERT_FALSE(backend_.StepPiece({&item, 1}, Pause::At({})).has_value());
      EXPECT_TRUE(ReadBits(backend_, dropped) == before) << scene.name << " while it is under way";
      if (how == Dropped::kAbandoned) backend_.AbandonStep(dropped);
      ClothUpdate update;
      update.parameters = scene.parameters;
      if (how == Dropped::kByWrite) {
        ASSERT_TRUE(backend_.Write(dropped, update).ok());
      }
      for (uint32_t step = 0; step < kSteps; ++step) {
        StepAlone(backend_, plain, scene);
        StepAlone(backend_, dropped, scene);
      }
      EXPECT_TRUE(ReadBits(backend_, dropped) == ReadBits(backend_, plain)) << scene.name;
      backend_.Destroy(plain);
      backend_.Destroy(dropped);
    }
  }
  backend_.Destroy(neighbour_);
}

// A step that takes longer than it may is left undone, and so is one whose turn does not come.
TEST_P(StepPieces, AreNotNeededForWhatWasLeftUndone) {
  Scene scene = SizedCloth(3000);
  Stir(scene, 0.2);
  scene.parameters.settings.substeps = 100;
  scene.parameters.settings.max_iterations = 20;
  const ClothHandle plain = CreateCloth(backend_, scene);
  const ClothHandle undone = CreateCloth(backend_, scene);
  const std::string before = ReadBits(backend_, undone);
  const StepItem item{undone, scene.pin_targets_m, true};
  const bool can_leave = GetParam() != "gl";
  for (const auto time : {std::chrono::microseconds(0), std::chrono::microseconds(500)}) {
    if (!can_leave) break;
    const Pause pause = Pause::At(std::chrono::steady_clock::now() + time);
    const StepReport report = backend_.StepUntil({&item, 1}, pause).reports[0];
    EXPECT_TRUE(report.is_undone);
    EXPECT_EQ(report.thread_us > 0, time.count() > 0);
    EXPECT_TRUE(ReadBits(backend_, undone) == before);
  }
  const StepReport expected = StepAlone(backend_, plain, scene);
  EXPECT_FALSE(expected.is_undone);
  StepInPieces(item);
  EXPECT_TRUE(ReadBits(backend_, undone) == ReadBits(backend_, plain));
  for (const ClothHandle cloth : {plain, undone, neighbour_}) backend_.Destroy(cloth);
}

class StepPiecesOfContacts : public StepPieces {};
INSTANTIATE_TEST_SUITE_P(Backends, StepPiecesOfContacts, testing::Values("reference", "cpu"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Of a thick sheet, of which everything touches everything: one search looks at more than a piece
// has time for. By one thread, and by a team.
TEST_P(StepPiecesOfContacts, StopWithinASearch) {
  for (const uint32_t side : {27u, 46u}) {
    Scene scene = Grid(side, side, 1, 1, {0});
    scene.parameters.self_collision.emplace().thickness_m = 0.3;
    scene.parameters.settings.substeps = 1;
    scene.parameters.settings.max_iterations = 1;
    Stir(scene, 0.2);
    const ClothHandle whole = CreateCloth(backend_, scene);
    const ClothHandle pieces = CreateCloth(backend_, scene);
    const ClothHandle dropped = CreateCloth(backend_, scene);
    const std::string before = ReadBits(backend_, dropped);
    pauses_ = 0;
    const StepReport expected = StepAlone(backend_, whole, scene, 1, true);
    const StepReport report = StepInPieces({pieces, scene.pin_targets_m, true}).reports[0];
    EXPECT_GT(pauses_, 20) << "of which 3 are between stages";
    EXPECT_EQ(report.measured.near_pairs, expected.measured.near_pairs);
    EXPECT_EQ(report.warnings.contacts_given_up, expected.warnings.contacts_given_up);
    EXPECT_TRUE(ReadBits(backend_, pieces) == ReadBits(backend_, whole));
    // Dropped wherever it has stopped, by a piece or by a batch.
    const StepItem item{dropped, scene.pin_targets_m, true};
    for (int count = 1; count < pauses_; count += 1 + pauses_ / 6) {
      for (int k = 0; k < count; ++k) {
        ASSERT_FALSE(backend_.StepPiece({&item, 1}, Pause::At({})).has_value());
      }
      backend_.AbandonStep(dropped);
      const auto time = std::chrono::milliseconds(count / 4);
      const Pause pause = Pause::At(std::chrono::steady_clock::now() + time);
      EXPECT_TRUE(backend_.StepUntil({&item, 1}, pause).reports[0].is_undone);
      EXPECT_TRUE(ReadBits(backend_, dropped) == before);
    }
    StepAlone(backend_, dropped, scene);
    EXPECT_TRUE(ReadBits(backend_, dropped) == ReadBits(backend_, whole));
    for (const ClothHandle cloth : {whole, pieces, dropped}) backend_.Destroy(cloth);
  }
  backend_.Destroy(neighbour_);
}

// The lengths at which a step begins are not those to which a dropped one went.
TEST_P(StepPieces, DrivenLengthsBeginWhereTheLastStepEnded) {
  Scene scene = SizedCloth(1100);
  scene.parameters.settings.substeps = 3;
  const std::vector<double> lengths_m(scene.model->constraint_count(), 0.05);
  const std::vector<double> longer_m(scene.model->constraint_count(), 0.06);
  std::vector<ClothHandle> cloths;
  for (int k = 0; k < 2; ++k) {
    cloths.push_back(CreateCloth(backend_, scene));
    ClothUpdate update;
    update.rest_lengths_m = lengths_m;
    ASSERT_TRUE(backend_.Write(cloths.back(), update).ok());
  }
  StepItem item{cloths[1], scene.pin_targets_m, false, longer_m};
  ASSERT_FALSE(backend_.StepPiece({&item, 1}, Pause::At({})).has_value());
  backend_.AbandonStep(cloths[1]);
  if (GetParam() != "gl") {
    ClothUpdate longer, as_before;
    as_before.parameters = scene.parameters;
    scene.parameters.settings.substeps = 2000;
    longer.parameters = scene.parameters;
    ASSERT_TRUE(backend_.Write(cloths[1], longer).ok());
    const Pause soon = Pause::At(std::chrono::steady_clock::now() + std::chrono::microseconds(500));
    ASSERT_TRUE(backend_.StepUntil({&item, 1}, soon).reports[0].is_undone);
    ASSERT_TRUE(backend_.Write(cloths[1], as_before).ok());
  }
  for (const ClothHandle cloth : cloths) {
    item.cloth = cloth;
    backend_.Step({&item, 1});
  }
  EXPECT_TRUE(ReadBits(backend_, cloths[0]) == ReadBits(backend_, cloths[1]));
  for (const ClothHandle cloth : cloths) backend_.Destroy(cloth);
  backend_.Destroy(neighbour_);
}

// Edges and triangles look for each of many colliders, in one stage; so do particles, in one sweep.
TEST_P(StepPiecesOfContacts, StopBetweenTheCollidersOfAStage) {
  Scene scene = Grid(50, 50, 1, 1);
  for (int k = 0; k < 40; ++k) {
    scene.parameters.colliders.push_back(
        BoxAt({0.02 * k - 0.4, -0.011, 0.3 * std::sin(k)}, {0.01, 0.01, 0.01}));
  }
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  scene.parameters.settings.collider_contact = ColliderContact::kSurface;
  scene.parameters.settings.substeps = 4;
  Stir(scene, 0.2);
  const bool is_cpu = GetParam() == "cpu";
  const ClothHandle whole = CreateCloth(backend_, scene);
  const ClothHandle pieces = CreateCloth(backend_, scene);
  for (uint32_t step = 0; step < kSteps; ++step) {
    StepAlone(backend_, whole, scene);
    pauses_ = 0;
    StepInPieces({pieces, scene.pin_targets_m});
    EXPECT_GT(pauses_, is_cpu ? 100 : 700) << "of which " << (is_cpu ? 30 : 613) << " are between";
    EXPECT_TRUE(ReadBits(backend_, pieces) == ReadBits(backend_, whole));
  }
  for (const ClothHandle cloth : {whole, pieces, neighbour_}) backend_.Destroy(cloth);
}

// What a step in pieces may take counts each pair of a particle and a collider, and more where
// edges touch them.
TEST_P(StepPiecesOfContacts, CountTheMemoryOfTheirColliders) {
  const auto bytes_of = [&](uint32_t colliders, ColliderContact contact) {
    Scene scene = Grid(50, 50, 1, 1);
    for (uint32_t k = 0; k < colliders; ++k) {
      scene.parameters.colliders.push_back(BoxAt({0, -0.5 - k, 0}, {0.1, 0.1, 0.1}));
    }
    scene.parameters.settings.collider_contact = contact;
    const ClothHandle cloth = CreateCloth(backend_, scene);
    const uint64_t bytes = backend_.LongStepBytes({&cloth, 1});
    backend_.Destroy(cloth);
    return bytes;
  };
  const uint64_t alone = bytes_of(0, ColliderContact::kSurface);
  const uint64_t of_particles = bytes_of(20, ColliderContact::kParticles);
  const uint64_t of_edges = bytes_of(20, ColliderContact::kSurface);
  constexpr uint64_t kPairs = 20 * 50 * 50;
  EXPECT_GE(of_particles, alone + 40 * kPairs);
  EXPECT_GE(of_edges, of_particles + 1000 * kPairs) << "a contact has some 200 bytes";
  backend_.Destroy(neighbour_);
}

TEST(CpuStepPieces, HaveTheSameBitsWithAnyNumberOfThreads) {
  Scene scene = SizedCloth(5000);
  Stir(scene, 0.2);
  std::string expected;
  for (const uint32_t threads : {1u, 2u, 4u}) {
    const std::unique_ptr<Backend> backend = CreateCpuBackend({threads});
    const ClothHandle cloth = CreateCloth(*backend, scene);
    const StepItem item{cloth, scene.pin_targets_m};
    while (!backend->StepPiece({&item, 1}, Pause::At({})).has_value()) {
    }
    if (expected.empty()) expected = ReadBits(*backend, cloth);
    EXPECT_TRUE(ReadBits(*backend, cloth) == expected) << threads;
  }
}

}  // namespace
}  // namespace drape::test
