// Edges and triangles against colliders: cpu against the reference, from states in which each kind
// of contact is about to begin.
#include <gtest/gtest.h>

#include "tests/parity/round_off.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Far less than particles alone move: a sheet of coarse cells that is thrown at a ball, a bar, a
// corner of a box and a rim, each of which meets the inside of an edge or a triangle first. The
// backends choose the same planes, of places that rounding moves, so the bound is that of what
// falls freely: velocities of metres per second times roundings, and the errors of their links.
TEST(SurfaceContactParity, CpuIsTheReferenceToRounding) {
  const std::vector<Collider> colliders = {
      SphereAt({0.4, -0.21, 0.45}, 0.2),
      CapsuleBetween({0.3, -0.06, 0.1}, {0.45, -0.06, 0.9}, 0.05),
      BoxAt({0.45, -0.35, 0.5}, {0.2, 0.2, 0.2},
            Eigen::Quaterniond::FromTwoVectors(Vector3d(1, 1.1, 0.9).normalized(),
                                               Vector3d::UnitY())),
      CylinderBetween({0.42, -0.4, 0.5}, {0.45, -0.01, 0.52}, 0.1)};
  for (const Collider& collider : colliders) {
    Scene scene = Grid(6, 6, 0.8, 0.8);
    scene.parameters.colliders = {collider};
    scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.settings.collider_contact = ColliderContact::kSurface;
    scene.state.velocities_m_per_s.assign(scene.model->particle_count(), Vector3d(0.2, -1, 0.1));
    ParticleState ends[2];
    for (int k = 0; k < 2; ++k) {
      Backend& backend = SharedBackend(k == 0 ? "reference" : "cpu");
      const ClothHandle cloth = CreateCloth(backend, scene);
      StepAlone(backend, cloth, scene, 3);
      ends[k] = ReadState(backend, cloth);
      backend.Destroy(cloth);
    }
    double farthest = 0, moved = 0;
    for (size_t i = 0; i < ends[0].positions_m.size(); ++i) {
      const Vector3d free = scene.state.positions_m[i] + 0.05 * Vector3d(0.2, -1, 0.1) -
                            Vector3d(0, 9.81 * 0.05 * 0.05 / 2, 0);
      farthest = std::max(farthest, (ends[0].positions_m[i] - ends[1].positions_m[i]).norm());
      moved = std::max(moved, (ends[0].positions_m[i] - free).norm());
    }
    EXPECT_GT(moved, 1e-3) << "it has met the collider";
    // In each of the 156 substeps a link's error is rounded by 2^-24 of 1 m, and a strip of five
    // links and the contacts hand it on.
    EXPECT_LE(farthest, 156 * 5 * 0x1p-24) << std::string(kShapeNames[size_t(collider.kind())]);
  }
}

}  // namespace
}  // namespace drape::test
