// What is held drags a cloth over something sharp that rests, with default settings: its edges are
// not caught, and nothing else than with PARTICLES happens while it is held still.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/surface_contact/contact_numbers.h"
#include "tests/physics/physics_test.h"
#include "tests/physics/random_drag.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class DraggedCloth : public PhysicsTest {
 protected:
  StepReport Step(ClothHandle cloth, const Drag& drag, double since_s) {
    const std::vector<Grip> held = drag.HeldAt(since_s);
    std::vector<Vector3d> targets;
    for (const Grip& grip : held) targets.push_back(grip.target_m);
    StepItem item{cloth, {}, true};
    if (drag.is_gripped) {
      item.grips = held;
    } else {
      item.pin_targets_m = targets;
    }
    return backend().Step({&item, 1}).reports[0];
  }

  // The largest strain and the largest 99th percentile, but for the beginning of the drag, when
  // what has sunk onto an edge at rest, by half a cell at the corner of a box, comes out.
  std::pair<double, double> Strains(Drag drag, ColliderContact contact) {
    drag.scene.parameters.settings.collider_contact = contact;
    const ClothHandle cloth = Make(drag.scene);
    const double step_s = drag.scene.parameters.settings.time_step_s;
    double largest = 0, p99 = 0;
    for (double t = step_s; t < drag.settle_s + drag.drag_s; t += step_s) {
      const StepReport report = Step(cloth, drag, t - drag.settle_s);
      EXPECT_EQ(report.fault, FaultReason::kNone);
      const double since_s = t - drag.settle_s;
      const double out_s = drag.cell_m / 2 / surface_contact::kRecovery_m_per_s;
      if (since_s > 0 && since_s < out_s) continue;
      largest = std::max(largest, report.measured.max_strain);
      p99 = std::max(p99, report.measured.strain_p99);
    }
    return {largest, p99};
  }

  void ExpectNoneCaught(uint32_t first_seed, uint32_t end_seed);
  static uint32_t ShortSeeds() { return GetParam() == "cpu" ? 12 : 2; }
};
INSTANTIATE_TEST_SUITE_P(Backends, DraggedCloth, testing::ValuesIn(OwnBackendNames()),
                         [](const auto& one) { return one.param; });

// How much a mesh gives by itself. Behind the front of a hit (impact_test), in REALTIME
// (presets.md, "What lands"); and one cell of its width carries all that a held particle pulls: the
// weight, which friction multiplies where the cloth bends around a quarter of a circle.
double StretchOfMesh(const Drag& drag) {
  const ClothParameters& parameters = drag.scene.parameters;
  constexpr double kSigma_kg_per_m2 = 0.2;
  const double fall = parameters.gravity_m_per_s2.norm() * 0.1;  // [m/s], some 5 cm
  const double hit = 7.1 / 4.9 * (drag.velocities[0].norm() + fall) *
                     std::sqrt(kSigma_kg_per_m2 / kMeshStretchStiffness_n_per_m);
  const double pull = drag.scene.model->total_mass_kg() * parameters.gravity_m_per_s2.norm() *
                      std::exp(parameters.friction_static * std::numbers::pi / 2);
  return hit + pull / (kMeshStretchStiffness_n_per_m * drag.cell_m);
}

void DraggedCloth::ExpectNoneCaught(uint32_t first_seed, uint32_t end_seed) {
  uint32_t caught = 0;
  for (uint32_t seed = first_seed; seed < end_seed; ++seed) {
    SCOPED_TRACE(seed);
    const Drag drag = RandomDrag(seed);
    const auto [largest, p99] = Strains(drag, StepSettings().collider_contact);
    const double of_mesh = drag.is_mesh ? StretchOfMesh(drag) : 0;
    std::printf("[ MEASURED ] drag %u on %s: %.2f %%, 99th percentile %.2f %%\n", seed,
                GetParam().c_str(), 100 * largest, 100 * p99);
    EXPECT_LE(largest, 0.05 + of_mesh);
    if (GetParam() != "cpu") continue;
    caught += Strains(drag, ColliderContact::kParticles).first > 0.05 + of_mesh;
  }
  if (GetParam() == "cpu") {
    EXPECT_GE(6 * caught, end_seed - first_seed) << "nothing to catch";
  }
}

// As sharp_collider_test: 5 % is where a warning begins.
TEST_P(DraggedCloth, IsNotCaught) {
  ExpectNoneCaught(0, ShortSeeds());
}

class DraggedClothLong : public DraggedCloth {};
INSTANTIATE_TEST_SUITE_P(Backends, DraggedClothLong, testing::ValuesIn(OwnBackendNames()),
                         [](const auto& one) { return one.param; });

TEST_P(DraggedClothLong, IsNotCaught) {
  ExpectNoneCaught(ShortSeeds(), GetParam() == "cpu" ? 64 : 8);
}

// Step by step, from the same state: with SURFACE while something that is held moves, with
// PARTICLES while it does not, or more slowly than counts.
TEST_P(DraggedCloth, LetsEdgesTouchOnlyWhileItIsPulled) {
  for (const uint32_t seed : {0u, 9u}) {
    Drag drag = RandomDrag(seed);
    const double step_s = drag.scene.parameters.settings.time_step_s;
    drag.drag_s = 20.5 * step_s;
    const ClothHandle cloth = Make(drag.scene);
    uint32_t differing = 0;
    for (int step = -50; step < 30; ++step) {
      const double since_s = step * step_s;
      const bool is_pulled = step > 0 && step <= 21;
      const bool is_slow = step < -25;
      Scene scene = drag.scene;
      scene.state = ReadState(backend(), cloth);
      Drag now = drag;
      if (is_slow) {  // there and back, half as fast as counts
        const double sign = step % 2 == 0 ? 1 : -1;
        for (Vector3d& start : now.starts) {
          start += Vector3d(sign * 0.25 * kStillHold_m_per_s * step_s, 0, 0);
        }
      }
      std::string bits[2];
      for (const bool has_edges : {false, true}) {
        scene.parameters.settings.collider_contact =
            has_edges ? ColliderContact::kSurface : ColliderContact::kParticles;
        const ClothHandle other = CreateCloth(backend(), scene);
        Step(other, now, since_s);
        bits[has_edges] = ReadBits(backend(), other);
        backend().Destroy(other);
      }
      Step(cloth, now, since_s);
      EXPECT_TRUE(ReadBits(backend(), cloth) == bits[is_pulled]) << step;
      differing += bits[0] != bits[1];
    }
    EXPECT_GT(differing, 10u) << "edges never matter";
  }
}

}  // namespace
}  // namespace drape::test
