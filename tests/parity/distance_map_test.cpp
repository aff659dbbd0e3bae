// Contacts with distance maps, every backend in single precision against the reference. Bounds:
// round_off.h.
#include "server/scene/distance_map.h"

#include <gtest/gtest.h>

#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/solids/solids.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class DistanceMapParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, DistanceMapParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

Scene FreeParticles(const std::vector<Vector3d>& positions) {
  ParticleTopology particles;
  particles.positions_m = positions;
  particles.masses_kg.assign(positions.size(), 0.1);
  return Particles(particles);
}

void SetSubsteps(Scene& scene, uint32_t substeps, uint32_t max_iterations) {
  scene.parameters.settings.substeps = substeps;
  scene.parameters.settings.max_iterations = max_iterations;
}

// Whether the bound of round_off.h holds at a point: away from faces between cells, where the
// gradient jumps, and with a gradient of at least 1/2.
bool IsSteady(const DistanceMap& map, const Vector3d& p) {
  const Vector3d in_cells = (p - map.low_m()) / map.cell_m();
  if (((in_cells - Vector3d(in_cells.array().round())).array().abs() < 1e-3).any()) return false;
  const double step = 1e-4 * map.cell_m();
  Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d along = step * Vector3d::Unit(axis);
    gradient[axis] = (map.DistanceAt(p + along) - map.DistanceAt(p - along)) / (2 * step);
  }
  return gradient.norm() >= 0.5;
}

// At rest, inside and within the thickness around a torus, within the grid and beyond it: each is
// pushed along the normal where it is, for one sweep. 700 are stepped by the resident plan, 1500 by
// the tiled one.
TEST_P(DistanceMapParityTest, SolveContactsAroundADistanceMap) {
  const auto map = DistanceMap::Build(TorusMesh(0.5, 0.2, 24), {.resolution = 24}).value();
  const RigidTransform transform{{0.3, -0.7, 1.1},
                                 Eigen::Quaterniond(0.9, 0.1, 0.3, -0.2).normalized()};
  const double thickness = 0.35;
  std::vector<Vector3d> places;
  uint32_t outside_count = 0;
  for (const Vector3d& p : PointsAround(map->mesh(), 4000, thickness)) {
    if (!IsSteady(*map, p)) continue;
    places.push_back(p);
    outside_count +=
        (p.array() < map->low_m().array()).any() || (p.array() > map->high_m().array()).any();
  }
  ASSERT_GE(places.size(), 1500u);
  EXPECT_GE(outside_count, 100u);
  for (const size_t count : {700u, 1500u}) {
    std::vector<Vector3d> positions;
    for (size_t k = 0; k < count; ++k) positions.push_back(transform * places[k]);
    Scene scene = FreeParticles(positions);
    scene.parameters.gravity_m_per_s2.setZero();
    scene.parameters.colliders = {DistanceMapAt(map, transform)};
    scene.parameters.thickness_m = thickness;
    SetSubsteps(scene, 1, 1);
    ExpectParity(GetParam(), scene, 1);
  }
}

// The particles move where the gradient is the same in all cells: at faces of a box. One touches
// nothing.
TEST_P(DistanceMapParityTest, SolveContactsWithADistanceMapInMotion) {
  const auto map =
      DistanceMap::Build(BoxMesh({-0.5, -0.3, -0.4}, {0.5, 0.3, 0.4}), {.resolution = 40}).value();
  const RigidTransform transform{
      {0.1, -0.5, 0.2}, Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vector3d(1, 2, -2) / 3))};
  std::vector<Vector3d> positions;
  for (const Vector3d& local :
       {Vector3d(0.1, 0.32, 0.05), Vector3d(-0.2, 0.1, 0.31), Vector3d(-0.47, 0.02, -0.05),
        Vector3d(0.1, -0.31, 0.05), Vector3d(2, 3, -1)}) {
    positions.push_back(transform * local);
  }
  Scene scene = FreeParticles(positions);
  scene.parameters.colliders = {DistanceMapAt(map, transform)};
  scene.parameters.thickness_m = 0.02;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.3;
  scene.state.velocities_m_per_s.assign(positions.size(),
                                        transform.rotation * Vector3d(-0.1, -0.5, 0.05));
  for (const uint32_t sweeps : {1u, 4u}) {
    SetSubsteps(scene, 1, sweeps);
    ExpectParity(GetParam(), scene, 2);
  }
}

// In the middle of a box with an odd number of cells the gradient is 0: all push along the mesh's
// +y.
TEST_P(DistanceMapParityTest, SolveContactsWhereADistanceHasNoGradient) {
  const auto map = DistanceMap::Build(BoxMesh(Vector3d::Constant(-0.5), Vector3d::Constant(0.5)),
                                      {.resolution = 9})
                       .value();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1, Vector3d::UnitX()));
  Scene scene = FreeParticles({{0, 0, 0}});
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.colliders = {DistanceMapAt(map, {Vector3d::Zero(), turn})};
  SetSubsteps(scene, 1, 1);
  ExpectParity(GetParam(), scene, 1);
  Backend& backend = SharedBackend(GetParam());
  const ClothHandle cloth = CreateCloth(backend, scene);
  StepAlone(backend, cloth, scene);
  const Vector3d v = ReadState(backend, cloth).velocities_m_per_s[0];
  // Out at the depenetration speed of 1 m/s, to rounding of half a metre over the step.
  EXPECT_LE((v - turn * Vector3d::UnitY()).norm(), 32 * 0x1p-24 * 60);
  backend.Destroy(cloth);
}

}  // namespace
}  // namespace drape::test
