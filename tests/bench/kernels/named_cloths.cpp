#include "tests/bench/kernels/named_cloths.h"

#include "server/scene/colliders.h"
#include "server/solver/load.h"
#include "tests/bench/bench_scenes.h"

namespace drape::bench {

namespace {

constexpr uint32_t kSide = 32;
constexpr uint32_t kLargeSide = 256;

test::Scene Realtime(test::Scene scene) {
  scene.parameters.settings = SettingsOf("REALTIME");
  scene.parameters.damping_per_s = 0.2;
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
  return scene;
}

test::Scene TwoCorners(uint32_t side, const StructuralMaterial& material = {}) {
  return Realtime(test::Grid(side, side, 1, 1, {0, side - 1}, material));
}

test::Scene Windy() {
  test::Scene scene = TwoCorners(kSide);
  scene.parameters.air_drag = scene.parameters.air_lift = 1;
  return scene;
}

// A sheet that falls on its edge and folds.
test::Scene Folding() {
  test::Scene scene = Realtime(test::Grid(kSide, kSide, 1, 1));
  ClothParameters& parameters = scene.parameters;
  parameters.colliders = {PlaneThrough(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY())};
  parameters.friction_static = parameters.friction_dynamic = 0.3;
  parameters.self_collision =
      SelfCollision{.thickness_m = 0.003, .friction_static = 0.3, .friction_dynamic = 0.3};
  // Not quite upright, a metre high.
  for (Eigen::Vector3d& p : scene.state.positions_m) p = {p.x(), 0.05 + p.z(), 0.05 * p.z()};
  return scene;
}

}  // namespace

std::vector<NamedCloth> NamedCloths() {
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-5, .shear_modulus_n_per_m = 20};
  return {{"two_corners", TwoCorners(kSide)},
          {"two_corners_elimination", TwoCorners(kSide), StripSolve::kElimination},
          {"two_corners_both_ends", TwoCorners(kSide), StripSolve::kFromBothEnds},
          {"contacts", Realtime(test::FallingOnSphere(kSide))},
          {"bending_shear", TwoCorners(kSide, fabric)},
          {"wind", Windy()},
          {"small", TwoCorners(8)},
          {"mesh", Realtime(test::MeshedGrid(kSide, kSide, 1, 1, {0, kSide - 1}))},
          {"tiled", TwoCorners(kLargeSide)},
          {"tiled_contacts", Realtime(Figure4(kLargeSide, SettingsOf("REALTIME")))},
          {.name = "mesh_fabric",
           .scene = Realtime(test::MeshedGrid(kSide, kSide, 1, 1, {0, kSide - 1}, fabric)),
           .is_counted = false},
          {.name = "folding", .scene = Folding(), .steps = 45, .is_counted = false},
          {.name = "tiled_512", .scene = TwoCorners(512), .steps = 5, .is_counted = false},
          {.name = "impulses", .scene = TwoCorners(kSide), .tells_impulses = true},
          {.name = "contacts_impulses",
           .scene = Realtime(test::FallingOnSphere(kSide)),
           .tells_impulses = true}};
}

}  // namespace drape::bench
