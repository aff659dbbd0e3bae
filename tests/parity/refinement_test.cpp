// Stage `refine`, every backend in single precision against the reference. Bounds: round_off.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "tests/parity/loose_particles.h"
#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kEdge_m = 0.05;  // of SizedCloth

class RefinementParityTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, RefinementParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// The middle of a sheet at rest is thrown about, each particle in another direction. Strips cross
// each other at odd angles there; elsewhere they leave almost no error. `hit`: the direction.
Scene SheetHitInTheMiddle(uint32_t particle_count, Integration integration, int hit) {
  Scene scene = SizedCloth(particle_count);
  scene.parameters.gravity_m_per_s2.setZero();
  scene.parameters.settings.integration = integration;
  scene.parameters.settings.direction = Direction::kAtEnd;
  SetSubsteps(scene, 2);
  // With two steps the first substeps are shorter.
  const double speed_m_per_s = integration == Integration::kTwoStep ? 4 : 2;
  const auto rest = scene.model->rest_positions_m();
  const Vector3d middle = (rest.front() + rest.back()) / 2;
  for (uint32_t i = 0; i < particle_count; ++i) {
    if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
    if ((rest[i] - middle).norm() > 0.11) continue;
    const double angle = 2.4 * i + hit;
    scene.state.velocities_m_per_s[i] =
        speed_m_per_s * Vector3d(std::cos(angle), 3 * std::sin(3 * angle), std::sin(angle));
  }
  return scene;
}

std::vector<Vector3d> ReferencePositions(Scene scene, double refine_above_strain,
                                         double tolerance) {
  scene.parameters.settings.refine_above_strain = refine_above_strain;
  scene.parameters.settings.tolerance = tolerance;
  Backend& reference = SharedBackend("reference");
  const ClothHandle cloth = CreateCloth(reference, scene);
  StepAlone(reference, cloth, scene);
  const ParticleState state = ReadState(reference, cloth);
  reference.Destroy(cloth);
  return state.positions_m;
}

// The largest distance of a step from the reference (ExpectParity).
double PositionBound(Scene scene) {
  scene.parameters.settings.refine_above_strain = 1e-2;
  const uint32_t substeps = scene.parameters.settings.substeps;
  const RunScales scales{2.5, 14, 0};
  return RoundOffBound(scene, scales, substeps, substeps).position_m;
}

// A strain that links exceed but none comes near in any sweep: the ends of each may be off by
// `bound_m` without its being flagged by one backend alone. With limits a little larger or smaller,
// that of the tolerance too, the reference does the same to the bit, and it is not what it does
// without refinement. 0: there is none.
double StrainThatNoLinkComesNear(const Scene& scene, double bound_m) {
  const double tolerance = scene.parameters.settings.tolerance;
  const std::vector<Vector3d> plain = ReferencePositions(scene, 0, tolerance);
  const double margin = 2 * bound_m / kEdge_m;
  const double wide = tolerance > 0 ? tolerance + margin : 0;
  const double narrow = tolerance > 0 ? tolerance - margin : 0;
  for (double strain = std::max(5e-3, 2 * (margin + wide)); strain < 0.5; strain *= 1.02) {
    const std::vector<Vector3d> refined = ReferencePositions(scene, strain - margin, narrow);
    if (FindWorst(refined, plain).distance < 2 * bound_m) return 0;
    if (ReferencePositions(scene, strain + margin, wide) == refined) return strain;
  }
  return 0;
}

// Sets the strain and, if wanted, a tolerance. Returns whether such values exist.
bool SetLimits(Scene& scene, bool has_tolerance) {
  StepSettings& settings = scene.parameters.settings;
  const double bound_m = PositionBound(scene);
  const double smallest = 2.5 * bound_m / kEdge_m;
  for (double tolerance = smallest; tolerance < 0.1; tolerance *= 1.1) {
    settings.tolerance = has_tolerance ? tolerance : 0;
    settings.refine_above_strain = StrainThatNoLinkComesNear(scene, bound_m);
    if (settings.refine_above_strain > 0) return true;
    if (!has_tolerance) return false;
  }
  return false;
}

// Found once for all backends: the search takes longer than they do.
const std::optional<Scene>& SceneThatShowsTheStage(uint32_t particle_count, Integration integration,
                                                   bool has_tolerance) {
  static std::map<std::tuple<uint32_t, Integration, bool>, std::optional<Scene>> found;
  const auto [place, is_new] = found.try_emplace({particle_count, integration, has_tolerance});
  std::optional<Scene>& scene = place->second;
  for (int hit = 0; is_new && hit < 20 && !scene; ++hit) {
    scene = SheetHitInTheMiddle(particle_count, integration, hit);
    if (!SetLimits(*scene, has_tolerance)) scene.reset();
  }
  return scene;
}

// Both plans of gl, whose tiled one has other dispatches with a tolerance.
TEST_P(RefinementParityTest, Refine) {
  for (const uint32_t particle_count : {33u, 255u, 1025u}) {
    for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
      for (const bool has_tolerance : {false, true}) {
        const std::optional<Scene>& scene =
            SceneThatShowsTheStage(particle_count, integration, has_tolerance);
        ASSERT_TRUE(scene) << "none shows the stage: " << particle_count << " particles";
        ExpectParity(GetParam(), *scene, 1);
      }
    }
  }
}

// Deep inside a plane all particles come out at the same speed, from where refinement has moved
// them to.
TEST_P(RefinementParityTest, ContactsStartFromMovedParticles) {
  for (const uint32_t particle_count : {33u, 255u, 1025u}) {
    std::optional<Scene> scene;
    for (int hit = 0; hit < 20 && !scene; ++hit) {
      scene = SheetHitInTheMiddle(particle_count, Integration::kOneStep, hit);
      scene->parameters.settings.sweep = Sweep::kStrips;
      scene->parameters.colliders = {PlaneThrough({0, 2, 0}, {0, 1, 0})};
      if (!SetLimits(*scene, false)) scene.reset();
    }
    ASSERT_TRUE(scene) << "none shows the stage: " << particle_count << " particles";
    ExpectParity(GetParam(), *scene, 1);
  }
}

}  // namespace
}  // namespace drape::test
