// Fabrics under default settings, at rest, whatever their bending asks of a substep: the strip of
// Peirce's cantilever (1930, "The handle of cloth as a measurable quantity").
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "tests/physics/preset_test.h"
#include "tests/support/elastica.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kGravity_m_per_s2 = 9.81;
constexpr uint32_t kAcross = 3;

// Measured fabrics of their kind (client/examples/fabrics.md), and a thin card.
struct Fabric {
  const char* name;
  double rigidity_n_m;
  double density_kg_per_m2;
};
constexpr Fabric kFabrics[] = {
    {"silk", 3e-6, 0.08}, {"cotton", 1e-5, 0.12}, {"denim", 2e-4, 0.4}, {"card", 1e-2, 0.25}};

// The length over which a fabric bends by its own weight.
double BendingLength_m(const Fabric& fabric) {
  return std::cbrt(fabric.rigidity_n_m / (fabric.density_kg_per_m2 * kGravity_m_per_s2));
}

// A strip along +x that is clamped at its second line of particles; `overhang_m` in `cells` cells
// beyond. It begins straight.
Scene Clamped(const Fabric& fabric, double overhang_m, uint32_t cells) {
  const double cell_m = overhang_m / cells;
  const uint32_t columns = cells + 2;
  std::vector<uint32_t> pins;
  for (uint32_t row = 0; row < kAcross; ++row) {
    pins.push_back(row * columns);
    pins.push_back(row * columns + 1);
  }
  Scene scene = Grid(columns, kAcross, cell_m * (columns - 1), cell_m * (kAcross - 1), pins,
                     {.areal_density_kg_per_m2 = fabric.density_kg_per_m2,
                      .bending_rigidity_n_m = fabric.rigidity_n_m});
  scene.parameters.settings = StepSettings();
  scene.parameters.damping_per_s = 6;
  return scene;
}

// The same as an irregular mesh, edges along its sides.
Scene ClampedMesh(const Fabric& fabric, double overhang_m, uint32_t cells) {
  constexpr uint32_t kRows = 5;
  const double cell_m = overhang_m / cells;
  const uint32_t columns = cells + 2;
  std::mt19937 generator(cells);
  std::uniform_real_distribution<double> jitter_m(-cell_m / 4, cell_m / 4);
  ModelDescription description;
  TriangleMesh mesh;
  for (uint32_t i = 0; i < columns * kRows; ++i) {
    const uint32_t column = i % columns, row = i / columns;
    if (column < 2) description.pinned_particles.push_back(i);
    Vector3d& p = mesh.positions_m.emplace_back(column * cell_m, 0, row * cell_m);
    if (column > 1 && column + 1 < columns) p.x() += jitter_m(generator);
    if (column > 1 && row > 0 && row + 1 < kRows) p.z() += jitter_m(generator);
    if (column + 1 == columns || row + 1 == kRows) continue;
    const std::array<uint32_t, 4> corners = {i, i + columns, i + columns + 1, i + 1};
    const size_t first = generator() % 2;
    mesh.triangles.push_back({corners[first], corners[first + 1], corners[first + 2]});
    mesh.triangles.push_back({corners[first], corners[first + 2], corners[(first + 3) % 4]});
  }
  description.topology = mesh;
  description.material = {.areal_density_kg_per_m2 = fabric.density_kg_per_m2,
                          .stretch_stiffness_n_per_m = 2000,
                          .bending_rigidity_n_m = fabric.rigidity_n_m};
  Scene scene;
  scene.name = "mesh";
  scene.model = BuildModel(description);
  scene.state = RestState(*scene.model);
  scene.parameters.settings = StepSettings();
  scene.parameters.damping_per_s = 6;
  return scene;
}

class Cantilever : public PhysicsTest {
 protected:
  // How far the end of the strip has sunk once it rests.
  double Drop_m(const Scene& scene) {
    constexpr uint32_t kSteps = 150;
    const ClothHandle cloth = Make(scene);
    EXPECT_FALSE(StepAlone(backend(), cloth, scene, kSteps).warnings.elastic_beyond_limit);
    return -ReadState(backend(), cloth).positions_m.back().y();
  }
};

// How much farther than the elastica's the end of a hardly bent strip of n cells sinks, relative to
// it: a chain of lines that weigh w a (n + 1)/(n + 2) each, the last one too, with the moments of
// its joints' angles B/a, twice that at the clamp. The more it bends, the smaller is the error.
double ErrorOfChain(double n) {
  return (n + 1) / (n + 2) * (1 + 4 / (3 * n) + 1 / (n * n) + 2 / (3 * n * n * n)) - 1;
}

// The end is where the elastica has it, to the error of the chain of lines that the strip is: three
// overhangs, from hardly bent to hanging.
TEST_P(Cantilever, EveryFabricBendsAsTheElastica) {
  for (const Fabric& fabric : kFabrics) {
    for (const double bending_lengths : {1.2, 2.0, 3.0}) {
      const double overhang_m = bending_lengths * BendingLength_m(fabric);
      const double expected_m = ElasticaDrop_m(overhang_m, fabric.rigidity_n_m,
                                               fabric.density_kg_per_m2 * kGravity_m_per_s2);
      for (const uint32_t cells : {8u, 16u, 32u}) {
        // The others compute the same (tests/parity), more slowly.
        if (backend_name() != "cpu" && (bending_lengths != 2.0 || cells != 8)) continue;
        SCOPED_TRACE(fabric.name + (" " + std::to_string(bending_lengths)) +
                     " bending lengths in " + std::to_string(cells) + " cells");
        const double drop_m = Drop_m(Clamped(fabric, overhang_m, cells));
        EXPECT_NEAR(drop_m, expected_m, (ErrorOfChain(cells) + 1e-3) * expected_m);
      }
    }
  }
}

// A mesh bends by its hinges, about as stiff as B in every direction: within the 5 % that make one
// fabric look like another, whatever the fabric and the cell.
TEST_P(Cantilever, AnIrregularMeshBendsAsTheElastica) {
  for (const Fabric& fabric : kFabrics) {
    for (const uint32_t cells : {16u, 24u}) {
      if (backend_name() != "cpu" && (cells != 16 || fabric.name != std::string("cotton")))
        continue;
      SCOPED_TRACE(fabric.name + (" in " + std::to_string(cells)) + " cells");
      const double overhang_m = 2 * BendingLength_m(fabric);
      const double expected_m = ElasticaDrop_m(overhang_m, fabric.rigidity_n_m,
                                               fabric.density_kg_per_m2 * kGravity_m_per_s2);
      const Scene scene = ClampedMesh(fabric, overhang_m, cells);
      EXPECT_GT(PlanOf(scene).solver.hinge_stages, 0u);
      EXPECT_NEAR(Drop_m(scene), expected_m, 0.05 * expected_m);
    }
  }
}

}  // namespace

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Cantilever);

}  // namespace drape::test
