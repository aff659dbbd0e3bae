// A cloth that hangs and is damped comes to rest: nothing goes on moving that could be seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "tests/physics/physics_test.h"
#include "tests/support/garments.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// A free motion dies out as exp(-c t / 2), an overdamped one slower: the lowest swing of a sheet
// of 1 m (about 4 / s) is not overdamped. It begins with less than g.
constexpr double kDamping_per_s = 2;
constexpr uint32_t kSettleSteps = 720;  // 12 s
constexpr uint32_t kWatchedSteps = 60;
constexpr double kStep_s = 1.0 / 60;

// The second difference of positions over steps: what an eye sees tremble, however slowly the whole
// cloth still swings [m]. g exp(-12) dt^2 of the swing is left. In single precision a position of
// 1 m is known to 6e-8, and a link's error over a substep's interval of 2e-4 s is a velocity, which
// four times over a step of 1/60 s is 2e-5; two links meet in every corner.
constexpr double kMaxTremble_m = 5e-5;

Scene Damped(Scene scene, const std::string& name) {
  scene.name = name;
  scene.parameters.damping_per_s = kDamping_per_s;
  return scene;
}

Scene Hammock(uint32_t side) {
  return Grid(side, side, 1, 1, {0, side - 1, side * (side - 1), side * side - 1});
}

// Light, so that vertices are light for their links.
GarmentOptions LightMesh(uint32_t seed, double cell_m) {
  return {.seed = seed, .cell_m = cell_m, .areal_density_kg_per_m2 = 0.08};
}

Scene MeshOnSphere(const GarmentOptions& options) {
  Scene scene = LooseIrregularSheet(options);
  const Scene on_sphere = FallingOnSphere(4);
  scene.parameters.colliders = on_sphere.parameters.colliders;
  scene.parameters.friction_static = on_sphere.parameters.friction_static;
  scene.parameters.friction_dynamic = on_sphere.parameters.friction_dynamic;
  scene.parameters.thickness_m = on_sphere.parameters.thickness_m;
  return scene;
}

// Its gravity in that many times the usual one.
Scene Under(double gravity, Scene scene) {
  scene.parameters.gravity_m_per_s2 *= gravity;
  return scene;
}

std::vector<Scene> FewScenes() {
  return {Damped(Grid(12, 12, 1, 1, {0, 11}), "two_corners"), Damped(Hammock(10), "hammock"),
          Damped(MeshOnSphere(LightMesh(3, 0.1)), "irregular_mesh_on_sphere"),
          Damped(Grid(14, 11, 0.03, 0.025, {0, 13}), "small")};
}

// Rows and columns that pins hold taut, of cloths that are small for their number of particles, or
// heavy: their tension would be too much for the substep (server/solver/method.md, "Spans").
std::vector<Scene> Spans() {
  std::vector<Scene> scenes;
  scenes.push_back(Damped(Grid(30, 9, 0.11, 0.03, {0, 29}), "wide"));
  scenes.push_back(Damped(Grid(11, 27, 0.04, 0.09, {0, 10}), "tall"));
  scenes.push_back(Damped(Grid(21, 17, 0.05, 0.07, {0, 9, 20}), "three_points"));
  scenes.push_back(Damped(Grid(19, 19, 0.03, 0.03, {0, 18, 342, 360}), "small_hammock"));
  scenes.push_back(Damped(Grid(26, 12, 0.08, 0.04, {4, 21}), "two_inner_points"));
  scenes.push_back(Damped(Grid(18, 18, 0.06, 0.06, {90, 107}), "by_a_row"));
  scenes.push_back(Damped(Grid(40, 40, 0.15, 0.15, {0, 39}), "fine"));
  scenes.push_back(Damped(Under(10, Grid(15, 15, 0.5, 0.5, {0, 14})), "ten_g"));
  scenes.push_back(Damped(Under(1.62 / 9.81, Grid(15, 15, 0.012, 0.012, {0, 14})), "on_the_moon"));
  scenes.push_back(
      Damped(MeshedGrid(12, 12, 0.04, 0.04, {0, 11}, {.stretch_stiffness_n_per_m = 2000}), "mesh"));
  return scenes;
}

// What hangs on long columns, whose rounding errors add up along them: in single precision it
// comes to rest by its remainders in calm steps. Sheets by their first rows, a loaded chain.
Scene ByFirstRow(uint32_t columns, uint32_t rows, double width_m, double height_m,
                 const StructuralMaterial& material = {}) {
  std::vector<uint32_t> pins(columns);
  std::iota(pins.begin(), pins.end(), 0);
  return Grid(columns, rows, width_m, height_m, pins, material);
}

// Let go aslant; the last particle is as heavy as 200 others.
Scene LoadedChain(uint32_t links) {
  ParticleTopology particles;
  for (uint32_t k = 0; k <= links; ++k) {
    particles.positions_m.push_back({0.03 * k, 0, 0.01 * k});
    particles.masses_kg.push_back(k < links ? 0.005 : 1.0);
    if (k == 0) continue;
    const double length_m = std::hypot(0.03, 0.01);
    particles.distance_constraints.push_back({.i = k - 1, .j = k, .rest_length_m = length_m});
  }
  return Particles(particles, {0});
}

std::vector<Scene> FewColumns() {
  return {Damped(ByFirstRow(8, 50, 0.16, 1.0), "narrow_sheet"),
          Damped(LoadedChain(40), "loaded_chain")};
}

std::vector<Scene> Columns() {
  std::vector<Scene> scenes;
  scenes.push_back(Damped(ByFirstRow(32, 32, 1, 1), "sheet"));
  scenes.push_back(Damped(ByFirstRow(20, 50, 0.4, 1.0), "long_sheet"));
  scenes.push_back(Damped(ByFirstRow(48, 48, 1, 1), "fine_sheet"));
  scenes.push_back(Damped(
      ByFirstRow(20, 40, 0.4, 0.8, {.bending_rigidity_n_m = 1e-5, .shear_modulus_n_per_m = 40}),
      "fabric"));
  scenes.push_back(Damped(Grid(50, 35, 1.2, 0.9, {0, 49}), "two_corners"));
  return scenes;
}

// A tube whose rim is held, so that it falls into folds: `around` vertices in each of `rows` rings,
// off their places by up to `off` of their distances, diagonals drawn at random. Its hinges are
// drawn at an angle, and folds bend many of them flat.
Scene IrregularTube(uint32_t around, uint32_t rows, double hem_m, double off, uint32_t seed,
                    const StructuralMaterial& material) {
  std::mt19937 random(seed);
  const auto jitter = [&] { return off * (static_cast<double>(random()) / 4294967296.0 - 0.5); };
  TriangleMesh mesh;
  std::vector<uint32_t> rim(around);
  std::iota(rim.begin(), rim.end(), 0);
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * (k + jitter() + (row % 2) * 0.5) / around;
      const bool is_edge = row == 0 || row + 1 == rows;
      const double down = (row + (is_edge ? 0 : jitter())) / (rows - 1);
      const double radius_m = 0.18 + (hem_m - 0.18) * down;
      mesh.positions_m.emplace_back(radius_m * std::cos(angle), -0.7 * down,
                                    0.6 * radius_m * std::sin(angle));
    }
  }
  for (uint32_t row = 0; row + 1 < rows; ++row) {
    for (uint32_t k = 0; k < around; ++k) {
      const uint32_t a = row * around + k, b = row * around + (k + 1) % around;
      const uint32_t c = a + around, d = b + around;
      const bool is_falling = random() % 2 != 0;
      if (is_falling) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, d, c}, {a, b, d}});
      }
    }
  }
  Scene scene;
  scene.model = BuildModel({mesh, material, rim});
  scene.state = RestState(*scene.model);
  return scene;
}

StructuralMaterial Bending(double areal_density_kg_per_m2, double rigidity_n_m) {
  return {.areal_density_kg_per_m2 = areal_density_kg_per_m2,
          .stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m,
          .bending_rigidity_n_m = rigidity_n_m};
}

std::vector<Scene> FoldedTubes() {
  std::vector<Scene> scenes;
  scenes.push_back(Damped(IrregularTube(36, 30, 0.45, 0.5, 1, Bending(0.12, 1e-5)), "skirt"));
  scenes.push_back(Damped(IrregularTube(28, 26, 0.4, 0.4, 2, Bending(0.3, 1e-4)), "heavy"));
  scenes.push_back(Damped(IrregularTube(44, 18, 0.5, 0.6, 3, Bending(0.15, 3e-5)), "wide"));
  return scenes;
}

std::vector<Scene> ManyScenes() {
  std::vector<Scene> scenes;
  scenes.push_back(Damped(Grid(24, 24, 1, 1, {0, 23}), "two_corners"));
  scenes.push_back(Damped(Grid(24, 24, 1, 1, {0, 12, 23}), "three_points"));
  scenes.push_back(Damped(Grid(33, 11, 2, 0.7, {3, 27}), "two_inner_points"));
  scenes.push_back(Damped(Hammock(20), "hammock"));
  scenes.push_back(Damped(CompliantSheet(16, 1e-4), "compliant"));
  scenes.push_back(Damped(Net(12, 0.08, 1e-5), "net"));
  scenes.push_back(Damped(FallingOnSphere(16), "sphere"));
  scenes.push_back(Damped(FallingOnBoxAndCapsule(14), "box_and_capsule"));
  for (const Scene& garment : Garments({.seed = 5, .cell_m = 0.07})) {
    scenes.push_back(Damped(garment, "irregular_" + garment.name));
  }
  scenes.push_back(Damped(IrregularSheet(LightMesh(7, 0.05)), "light_irregular_sheet"));
  scenes.push_back(Damped(MeshOnSphere(LightMesh(8, 0.05)), "irregular_mesh_on_sphere"));
  return scenes;
}

// REALTIME. What does not rest as well is in tests/bench/notes/solver.md.
class RestTest : public PhysicsTest {
 protected:
  // The largest second difference of any particle over the watched steps [m].
  double Tremble(Scene scene) {
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.settings.time_step_s = kStep_s;
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, kSettleSteps);
    std::vector<Vector3d> before = ReadState(backend(), cloth).positions_m;
    StepAlone(backend(), cloth, scene);
    std::vector<Vector3d> now = ReadState(backend(), cloth).positions_m;
    double largest_m = 0;
    for (uint32_t step = 1; step < kWatchedSteps; ++step) {
      StepAlone(backend(), cloth, scene);
      const std::vector<Vector3d> next = ReadState(backend(), cloth).positions_m;
      for (size_t i = 0; i < next.size(); ++i) {
        largest_m = std::max(largest_m, (next[i] - 2 * now[i] + before[i]).norm());
      }
      before = std::move(now);
      now = next;
    }
    return largest_m;
  }

  void ExpectRest(const std::vector<Scene>& scenes) {
    for (const Scene& scene : scenes) {
      const double tremble_m = Tremble(scene);
      std::printf("[ MEASURED ] rest of %s on %s: %.4f mm\n", scene.name.c_str(),
                  backend_name().c_str(), 1e3 * tremble_m);
      EXPECT_LE(tremble_m, kMaxTremble_m) << scene.name;
    }
  }
};

TEST_P(RestTest, OfAHungCloth) {
  std::vector<Scene> scenes = FewScenes();
  if (backend_name() == "gl") scenes = {scenes[1], scenes[2]};  // the others in RestLong
  ExpectRest(scenes);
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(RestTest);

// Where grids and chains have remainders, or need none.
using ColumnRestTest = RestTest;

TEST_P(ColumnRestTest, OfWhatHangsOnLongColumns) {
  ExpectRest(FewColumns());
}

INSTANTIATE_TEST_SUITE_P(Backends, ColumnRestTest, testing::ValuesIn(OwnBackendNames()),
                         [](const auto& one) { return one.param; });

using ColumnRestLong = RestTest;

TEST_P(ColumnRestLong, OfWhatHangsOnLongColumns) {
  ExpectRest(Columns());
}

INSTANTIATE_TEST_SUITE_P(Backends, ColumnRestLong, testing::ValuesIn(OwnBackendNames()),
                         [](const auto& one) { return one.param; });

using RestLong = RestTest;

TEST_P(RestLong, OfHungCloths) {
  ExpectRest(FewScenes());
  ExpectRest(ManyScenes());
}

TEST_P(RestLong, OfTautRows) {
  ExpectRest(Spans());
}

TEST_P(RestLong, OfFoldedTubes) {
  ExpectRest(FoldedTubes());
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(RestLong);

}  // namespace
}  // namespace drape::test
