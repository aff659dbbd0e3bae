// Two backends as one: each cloth has the bits that its own backend gives it, whatever else the
// other one steps, and keeps its state when a change takes it from one to the other.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "server/scene/body_mass.h"
#include "server/solver/backend_pair.h"
#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/device_backend.h"
#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"
#include "tests/support/worlds/worlds.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

std::unique_ptr<Backend> GlAlone(bool runs_ahead = false) {
  auto gl = CreateTunedGlBackend({}, {.runs_ahead = runs_ahead});
  EXPECT_TRUE(gl.ok()) << gl.status().ToString();
  return std::move(*gl);
}

// Gl steps it.
Scene Plain(double speed_m_per_s = 0.3) {
  Scene scene = FallingOnSphere(9);
  scene.parameters.settings.substeps = 8;
  Stir(scene, speed_m_per_s);
  return scene;
}

// The same with edges and triangles that touch the sphere, for which gl has no kernels.
Scene WithSurface() {
  Scene scene = Plain();
  scene.parameters.settings.collider_contact = ColliderContact::kSurface;
  return scene;
}

std::vector<Scene> TwoLayers() {
  std::vector<Scene> layers;
  for (const double height_m : {0.02, 0.035}) {
    Scene& layer = layers.emplace_back(Grid(7, 7, 0.3, 0.3));
    layer.parameters.settings.substeps = 8;
    layer.parameters.thickness_m = 0.004;
    layer.parameters.is_in_world = true;
    layer.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
    for (auto& p : layer.state.positions_m) p.y() += height_m;
  }
  return layers;
}

StepItem ItemOf(ClothHandle cloth) {
  StepItem item;
  item.cloth = cloth;
  return item;
}

std::string BitsAfter(Backend& backend, const Scene& scene, int steps) {
  const ClothHandle cloth = CreateCloth(backend, scene);
  for (int k = 0; k < steps; ++k) backend.Step(std::vector{ItemOf(cloth)});
  const std::string bits = ReadBits(backend, cloth);
  backend.Destroy(cloth);
  return bits;
}

class BackendPair : public testing::Test {
 protected:
  static constexpr int kSteps = 4;

  const std::unique_ptr<Backend> gl_ = GlAlone();
  const std::unique_ptr<Backend> cpu_ = CreateCpuBackend();
  const std::unique_ptr<Backend> pair_ = MakeBackend("gl");
};

TEST_F(BackendPair, IsNamedLikeTheFirstAndSaysWhoStepsACloth) {
  const BackendDescription pair = pair_->Describe(), gl = gl_->Describe(), cpu = cpu_->Describe();
  EXPECT_EQ(pair.name, "gl");
  EXPECT_EQ(pair.device, gl.device);
  EXPECT_NE(pair_->device(), nullptr);
  const Scene plain = Plain(), surface = WithSurface();
  EXPECT_TRUE(pair.Steps(*surface.model, surface.parameters));
  EXPECT_FALSE(gl.Steps(*surface.model, surface.parameters));
  EXPECT_EQ(pair.plan_of(*plain.model, plain.parameters), "resident");
  EXPECT_EQ(pair.plan_of(*surface.model, surface.parameters),
            cpu.plan_of(*surface.model, surface.parameters));
}

TEST_F(BackendPair, EachClothHasTheBitsOfItsBackend) {
  Scene with_body = Plain();
  with_body.parameters.colliders.push_back(BoxAt({0.3, 0.6, 0.2}, {0.05, 0.05, 0.05}));
  with_body.parameters.colliders.back().mass_kg = 0.1;
  with_body.parameters.collider_motions.clear();
  for (const Collider& collider : with_body.parameters.colliders) {
    with_body.parameters.collider_motions.push_back(
        RigidMotion::AtRest(collider.is_body() ? CentreOfMass(collider) : CentreOf(collider)));
  }
  const std::vector<Scene> scenes = {WithSurface(), Plain(), with_body, Plain(0.5), WithSurface()};
  std::vector<ClothHandle> cloths;
  for (const Scene& scene : scenes) cloths.push_back(CreateCloth(*pair_, scene));
  ClothWorld layers(*pair_, 3, TwoLayers());
  for (int step = 0; step < kSteps; ++step) {
    std::vector<StepItem> items;
    for (const ClothHandle cloth : cloths) items.push_back(ItemOf(cloth));
    const std::vector<StepItem> layer_items = layers.Items(true);
    items.insert(items.begin() + 2, layer_items.begin(), layer_items.end());
    const BatchReport batch = pair_->Step(items);
    ASSERT_EQ(batch.reports.size(), items.size());
    EXPECT_GT(batch.reports[2].measured.smallest_distance_m, 0) << "of the world, in its place";
  }
  for (const size_t k : {0u, 2u, 4u}) {
    EXPECT_TRUE(ReadBits(*pair_, cloths[k]) == BitsAfter(*cpu_, scenes[k], kSteps)) << k;
  }
  for (const size_t k : {1u, 3u}) {
    EXPECT_TRUE(ReadBits(*pair_, cloths[k]) == BitsAfter(*gl_, scenes[k], kSteps)) << k;
  }
  ClothWorld alone(*cpu_, 3, TwoLayers());
  alone.Step(kSteps);
  EXPECT_TRUE(layers.Bits() == alone.Bits());
  for (const ClothHandle cloth : cloths) pair_->Destroy(cloth);
}

TEST_F(BackendPair, ReadsClothsOfBothInTheirOrder) {
  Scene small = Plain();
  const std::vector<Scene> scenes = {WithSurface(), Plain(0.5), Plain(), WithSurface()};
  std::vector<ClothHandle> cloths;
  for (const Scene& scene : scenes) cloths.push_back(CreateCloth(*pair_, scene));
  const std::vector<ClothHandle> wanted = {cloths[2], cloths[3], cloths[1], cloths[0]};
  const std::vector<uint32_t> particles = {1, 17, 40};
  const auto read = BeginRead(*pair_, {wanted, true, false, particles});
  std::vector<Vector3d> expected;
  for (const ClothHandle cloth : wanted) {
    const ParticleState state = ReadState(*pair_, cloth);
    for (const uint32_t i : particles) expected.push_back(state.positions_m[i]);
  }
  std::vector<StepItem> items;
  for (const ClothHandle cloth : cloths) items.push_back(ItemOf(cloth));
  pair_->Step(items);
  const StateColumns columns = read->Take();
  ASSERT_EQ(std::get<std::vector<float>>(columns.positions_m).size(), 3 * expected.size());
  EXPECT_TRUE(std::get<std::vector<float>>(columns.velocities_m_per_s).empty());
  for (size_t row = 0; row < expected.size(); ++row) {
    EXPECT_EQ(VectorAt(columns.positions_m, row), expected[row]) << row;
  }
  EXPECT_EQ(pair_->device()->CopyOnDevice({wanted}), nullptr);
  for (const ClothHandle cloth : cloths) pair_->Destroy(cloth);
}

// To the cores and back between two steps, while pins and the ball move: as if it had stayed.
TEST_F(BackendPair, AClothKeepsItsStateWhereverItGoes) {
  Scene scene = Plain();
  scene.parameters.collider_motions = {
      RigidMotion::AtRest(CentreOf(scene.parameters.colliders[0]))};
  scene.parameters.collider_motions[0].velocity_m_per_s = {0, 0.5, 0};
  while (scene.parameters.collider_motions.size() < scene.parameters.colliders.size()) {
    scene.parameters.collider_motions.push_back(
        RigidMotion::AtRest(CentreOf(scene.parameters.colliders.back())));
  }
  ClothParameters with_surface = scene.parameters;
  with_surface.settings.collider_contact = ColliderContact::kSurface;
  const auto neighbour = CreateCloth(*pair_, WithSurface());
  for (const bool begins_there : {false, true}) {
    Scene start = scene;
    if (begins_there) start.parameters = with_surface;
    const auto& [here, there] = begins_there ? std::pair(with_surface, scene.parameters)
                                             : std::pair(scene.parameters, with_surface);
    const ClothHandle cloth = CreateCloth(*pair_, start);
    const ClothHandle stays = CreateCloth(*pair_, start);
    for (int step = 0; step < kSteps; ++step) {
      pair_->Step(std::vector{ItemOf(cloth), ItemOf(neighbour), ItemOf(stays)});
      // What the session knows of the motions.
      std::vector<RigidMotion> motions = scene.parameters.collider_motions;
      motions[0].position_m +=
          (step + 1) * scene.parameters.settings.time_step_s * motions[0].velocity_m_per_s;
      const std::string before = ReadBits(*pair_, cloth);
      for (const ClothParameters& parameters : {there, here}) {
        ClothUpdate update;
        update.parameters = parameters;
        update.collider_motions = motions;
        ASSERT_TRUE(pair_->Write(cloth, update).ok());
        EXPECT_TRUE(ReadBits(*pair_, cloth) == before);
      }
    }
    EXPECT_TRUE(ReadBits(*pair_, cloth) == ReadBits(*pair_, stays)) << begins_there;
    pair_->Destroy(cloth);
    pair_->Destroy(stays);
  }
  pair_->Destroy(neighbour);
}

// Edges touch a box only while it moves (ColliderContact::kAuto).
TEST_F(BackendPair, AClothGoesOverWhenWhatIsSharpMayMove) {
  Scene scene = Plain();
  scene.parameters.settings.collider_contact = ColliderContact::kAuto;
  scene.parameters.colliders = {BoxAt({0.5, -0.1, 0.5}, {0.1, 0.1, 0.1})};
  const ClothHandle cloth = CreateCloth(*pair_, scene);
  pair_->Step(std::vector{ItemOf(cloth)});
  EXPECT_TRUE(ReadBits(*pair_, cloth) == BitsAfter(*gl_, scene, 1));
  Scene moving = scene;
  moving.state = ReadState(*pair_, cloth);
  moving.parameters.collider_motions = {
      RigidMotion::AtRest(CentreOf(scene.parameters.colliders[0]))};
  moving.parameters.collider_motions[0].velocity_m_per_s = {0, 1, 0};
  ClothUpdate update;
  update.collider_motions = moving.parameters.collider_motions;
  ASSERT_TRUE(pair_->Write(cloth, update).ok());
  pair_->Step(std::vector{ItemOf(cloth)});
  EXPECT_TRUE(ReadBits(*pair_, cloth) == BitsAfter(*cpu_, moving, 1));
  pair_->Destroy(cloth);
}

// Held by pins or by grips, with lengths of its own or without. In steps that pull it, it has the
// bits of the cores, in others those of gl, and so has one that starts from its state in between.
TEST_F(BackendPair, AClothGoesOverWhileItIsPulled) {
  for (int variant = 0; variant < 4; ++variant) {
    const bool is_gripped = variant % 2 == 1, has_own_lengths = variant >= 2;
    const std::vector<uint32_t> held = {0, 8};
    Scene scene = is_gripped ? Grid(9, 9, 1, 1) : Grid(9, 9, 1, 1, held);
    scene.parameters.settings.substeps = 8;
    scene.parameters.settings.collider_contact = ColliderContact::kAuto;
    scene.parameters.colliders = {BoxAt({0.5, -0.11, 0.5}, {0.1, 0.1, 0.1})};
    scene.parameters.max_grips = is_gripped ? 2 : 0;
    ASSERT_TRUE(gl_->Describe().Steps(*scene.model, scene.parameters));
    std::vector<Vector3d> targets;
    for (const uint32_t i : held) targets.push_back(scene.state.positions_m[i]);
    const auto begin = [&](Backend& backend) {
      const ClothHandle cloth = CreateCloth(backend, scene);
      if (!has_own_lengths) return cloth;
      ClothUpdate update;
      update.rest_lengths_m = std::vector<double>(scene.model->constraint_count(), 0.13);
      EXPECT_TRUE(backend.Write(cloth, update).ok());
      return cloth;
    };
    const ClothHandle cloth = begin(*pair_);
    for (int step = 0; step < 12; ++step) {
      const bool is_pulled = step / 3 % 2 == 1;
      std::vector<Grip> grips;
      for (size_t k = 0; k < held.size(); ++k) {
        if (is_pulled) targets[k] += Vector3d(0, 0.001, -0.01);
        grips.push_back({held[k], targets[k]});
      }
      const auto step_it = [&](Backend& backend, ClothHandle its) {
        StepItem item = ItemOf(its);
        if (is_gripped) item.grips = grips;
        if (!is_gripped && is_pulled) item.pin_targets_m = targets;
        backend.Step(std::vector{item});
      };
      scene.state = ReadState(*pair_, cloth);
      step_it(*pair_, cloth);
      for (Backend* const backend : {is_pulled ? cpu_.get() : gl_.get(), pair_.get()}) {
        const ClothHandle other = begin(*backend);
        step_it(*backend, other);
        EXPECT_TRUE(ReadBits(*pair_, cloth) == ReadBits(*backend, other)) << variant << step;
        backend->Destroy(other);
      }
    }
    pair_->Destroy(cloth);
  }
}

TEST_F(BackendPair, WhatIsFaultedStaysSoUntilAStateIsWritten) {
  Scene scene = Plain();
  scene.parameters.gravity_m_per_s2 = {0, -1e30, 0};
  const ClothHandle cloth = CreateCloth(*pair_, scene);
  EXPECT_NE(pair_->Step(std::vector{ItemOf(cloth)}).reports[0].fault, FaultReason::kNone);
  const std::string good = ReadBits(*pair_, cloth);
  ClothUpdate update;
  update.parameters = WithSurface().parameters;
  ASSERT_TRUE(pair_->Write(cloth, update).ok());
  EXPECT_NE(pair_->Step(std::vector{ItemOf(cloth)}).reports[0].fault, FaultReason::kNone);
  EXPECT_TRUE(ReadBits(*pair_, cloth) == good);
  ClothUpdate fresh;
  fresh.state = scene.state;
  ASSERT_TRUE(pair_->Write(cloth, fresh).ok());
  EXPECT_EQ(pair_->Step(std::vector{ItemOf(cloth)}).reports[0].fault, FaultReason::kNone);
  EXPECT_TRUE(ReadBits(*pair_, cloth) == BitsAfter(*cpu_, WithSurface(), 1));
  pair_->Destroy(cloth);
}

TEST_F(BackendPair, APieceIsOfTheBackendThatStepsTheCloth) {
  const Scene scene = WithSurface();
  const ClothHandle plain = CreateCloth(*pair_, Plain());
  const ClothHandle cloth = CreateCloth(*pair_, scene);
  const std::vector<StepItem> items = {ItemOf(cloth)};
  EXPECT_FALSE(pair_->StepPiece(items, Pause::At({})).has_value());
  pair_->AbandonStep(cloth);
  int pieces = 0;
  while (!pair_->StepPiece(items, Pause::At({})).has_value()) ++pieces;
  EXPECT_GT(pieces, 1);
  EXPECT_TRUE(ReadBits(*pair_, cloth) == BitsAfter(*cpu_, scene, 1));
  pair_->Destroy(plain);
  pair_->Destroy(cloth);
}

// The host steps the second backend's cloths while the device steps those of the first.
TEST(BackendPairAhead, CallsMeanwhileOnceWhoeverSteps) {
  const auto pair = PairBackends(GlAlone(true), CreateCpuBackend());
  ASSERT_TRUE(pair->device()->RunsAhead());
  const ClothHandle first = CreateCloth(*pair, Plain());
  const ClothHandle second = CreateCloth(*pair, WithSurface());
  for (const std::vector<ClothHandle>& batch : {std::vector{first}, {second}, {second, first}}) {
    std::vector<StepItem> items;
    for (const ClothHandle cloth : batch) items.push_back(ItemOf(cloth));
    int calls = 0;
    const BatchReport report = pair->device()->StepAhead(items, Pause::Never(), [&] { ++calls; });
    EXPECT_EQ(calls, 1) << batch.size();
    EXPECT_EQ(report.reports.size(), batch.size());
  }
  const auto cpu = CreateCpuBackend();
  EXPECT_TRUE(ReadBits(*pair, first) == BitsAfter(*pair, Plain(), 2));
  EXPECT_TRUE(ReadBits(*pair, second) == BitsAfter(*cpu, WithSurface(), 2));
  pair->Destroy(first);
  pair->Destroy(second);
}

}  // namespace
}  // namespace drape::test
