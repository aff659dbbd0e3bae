// The result of a world does not depend on its batch, slots, threads or pieces.
#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"
#include "tests/support/worlds/worlds.h"

namespace drape::test {
namespace {

constexpr uint32_t kSteps = 25;

// A heap of a grid and two meshes on a floor, big enough for several threads if asked to be.
std::vector<Scene> Heap(uint32_t side) {
  std::vector<Scene> scenes = {Grid(side, side, 0.5, 0.5), MeshedGrid(side, side - 1, 0.5, 0.4),
                               MeshedGrid(7, 9, 0.3, 0.4)};
  double height_m = 0.02;
  for (Scene& scene : scenes) {
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.settings.substeps = 12;
    scene.parameters.thickness_m = 0.004;
    scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
    scene.parameters.self_collision = drape::SelfCollision{};
    scene.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
    Stir(scene, 0.3);
    for (auto& p : scene.state.positions_m) p.y() += height_m;
    height_m += 0.03;
  }
  return scenes;
}

class WorldExactness : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, WorldExactness, testing::Values("reference", "cpu"),
                         [](const auto& one) { return std::string(one.param); });

std::string BitsAlone(Backend& backend, const std::vector<Scene>& scenes) {
  ClothWorld world(backend, 5, scenes);
  const auto reports = world.Step(kSteps, true);
  for (const StepReport& report : reports) EXPECT_GT(report.measured.near_pairs, 0u);
  return world.Bits();
}

TEST_P(WorldExactness, SameInOtherSlotsBesideOthersAndUnderAnotherNumber) {
  const std::unique_ptr<Backend> backend = MakeBackend(GetParam());
  const std::vector<Scene> scenes = Heap(8);
  const std::string expected = BitsAlone(*backend, scenes);
  std::vector<Scene> fewer = {scenes[1], scenes[0]};
  const ClothHandle first = CreateCloth(*backend, scenes[0]);
  ClothWorld other(*backend, 7, fewer);
  const ClothHandle last = CreateCloth(*backend, scenes[2]);
  ClothWorld world(*backend, 9, scenes);
  for (uint32_t step = 0; step < kSteps; ++step) {
    std::vector<StepItem> items(1);
    items[0].cloth = first;
    for (const ClothWorld* const each : {&other, &world}) {
      const std::vector<StepItem> more = each->Items(step % 2 == 0);
      items.insert(items.end(), more.begin(), more.end());
    }
    items.emplace_back();
    items.back().cloth = last;
    backend->Step(items);
  }
  EXPECT_TRUE(world.Bits() == expected);
  backend->Destroy(first);
  backend->Destroy(last);
}

TEST_P(WorldExactness, SameInPieces) {
  const std::unique_ptr<Backend> backend = MakeBackend(GetParam());
  const std::vector<Scene> scenes = Heap(8);
  const std::string expected = BitsAlone(*backend, scenes);
  ClothWorld world(*backend, 1, scenes);
  size_t pieces = 0;
  for (uint32_t step = 0; step < kSteps; ++step) {
    const std::vector<StepItem> items = world.Items();
    if (step == 3) {
      EXPECT_FALSE(backend->StepPiece(items, Pause::At({})).has_value());
      backend->AbandonStep(items[1].cloth);
      for (const StepReport& report : backend->StepUntil(items, Pause::At({})).reports) {
        EXPECT_TRUE(report.is_undone);
      }
    }
    // What the world is made of is made anew in each step, and may stop. Each piece has items of
    // its own, wherever the last one has stopped.
    ClothUpdate update;
    update.parameters = scenes[0].parameters;
    update.parameters->colliders[0].pose.position_m -= items[0].world.origin_m;
    update.may_cross_itself = backend->MayCrossItself(items[0].cloth);
    ASSERT_TRUE(backend->Write(items[0].cloth, update).ok());
    std::deque<std::vector<StepItem>> used{items};
    while (!backend->StepPiece(used.back(), Pause::At({})).has_value()) {
      for (StepItem& item : used.back()) item.world.origin_m.x() += static_cast<double>(++pieces);
      used.push_back(items);
    }
  }
  EXPECT_GT(pieces, kSteps);
  EXPECT_TRUE(world.Bits() == expected);
}

TEST(CpuWorldExactness, SameWithAnyNumberOfThreads) {
  const std::vector<Scene> scenes = Heap(46);  // teams step it
  std::string expected;
  for (const uint32_t threads : {1u, 2u, 4u}) {
    const std::unique_ptr<Backend> backend = CreateCpuBackend({threads});
    const std::string bits = BitsAlone(*backend, scenes);
    if (expected.empty()) expected = bits;
    EXPECT_TRUE(bits == expected) << threads;
  }
}

}  // namespace
}  // namespace drape::test
