// What is held drags a cloth over something sharp that rests, with default settings: its edges are
// not caught, and nothing else than with PARTICLES happens while it is held still.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/surface_contact/contact_numbers.h"
#include "tests/physics/physics_test.h"
#include "tests/support/garments.h"

namespace drape::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// A towel that falls onto a collider while one or two particles of its first row are held beyond
// that, and is then drawn over it.
struct Drag {
  Scene scene;
  bool is_mesh = false;
  std::vector<uint32_t> held;
  std::vector<Vector3d> starts;  // of what is held
  bool is_gripped = false;       // else it is pinned
  Vector3d velocity;
  double cell_m = 0;
  double settle_s = 0.5, drag_s = 0;

  // What is held, `since_s` after the fall.
  std::vector<Grip> HeldAt(double since_s) const {
    std::vector<Grip> grips;
    for (size_t k = 0; k < held.size(); ++k) {
      grips.push_back({held[k], starts[k] + std::clamp(since_s, 0.0, drag_s) * velocity});
    }
    return grips;
  }
};

class Numbers {
 public:
  explicit Numbers(uint32_t seed) : random_(seed) {}
  double In(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }
  uint32_t Below(uint32_t count) { return static_cast<uint32_t>(In(0, count)); }

 private:
  std::mt19937 random_;
};

// A table, a turned box, a cylinder or a thin capsule that the first row is beyond of. None so thin
// that it comes through the cloth while nothing moves (collider_contact.cpp).
Collider SharpCollider(uint32_t kind, const Vector3d& corner, double width, double edge,
                       Numbers& random) {
  const double beyond = random.In(0.06, 0.2), top = random.In(-0.05, -0.01);
  const Quaterniond turn(AngleAxisd(random.In(-0.4, 0.4), Vector3d::UnitY()));
  if (kind < 2) {
    const Vector3d half(random.In(0.3, 0.6), random.In(0.1, 0.3), random.In(0.2, 0.4));
    const Vector3d axis = Vector3d(random.In(-1, 1), 0, random.In(-1, 1)).normalized();
    const double tilt = kind == 1 ? random.In(-0.4, 0.4) : 0;
    const double lower = kind == 1 ? 0.08 : 0;
    return BoxAt(corner + Vector3d(width / 2, top - half.y() - lower, beyond + half.z()), half,
                 turn * Quaterniond(AngleAxisd(tilt, axis)));
  }
  const double radius = kind == 2 ? random.In(edge, 0.1) : edge * random.In(1, 1.45);
  const Vector3d along = turn * Vector3d(random.In(0.3, 0.6), random.In(-0.1, 0.1), 0);
  const double height = top - radius - std::abs(along.y());
  const Vector3d centre = corner + Vector3d(width / 2, height, beyond + random.In(0, 0.2));
  return kind == 2 ? CylinderBetween(centre - along, centre + along, radius)
                   : CapsuleBetween(centre - along, centre + along, radius);
}

// Whether what is held keeps clear of the collider all the way: else it would be drawn into it.
bool IsClear(const Drag& drag, const Collider& collider) {
  const double clearance = 0.02 + drag.scene.parameters.thickness_m;
  for (int k = 0; k <= 50; ++k) {
    for (const Grip& grip : drag.HeldAt(drag.drag_s * k / 50)) {
      if (SurfaceOf(collider, grip.target_m).distance_m <= clearance) return false;
    }
  }
  return true;
}

Drag RandomDrag(uint32_t seed) {
  Numbers random(seed + 1000);
  Drag drag;
  drag.is_mesh = seed / 4 % 2 == 1;
  drag.is_gripped = seed / 8 % 2 == 1;
  const uint32_t columns = 12 + random.Below(13), rows = 12 + random.Below(13);
  const double width = random.In(0.5, 0.8), height = random.In(0.5, 0.8);
  drag.cell_m = width / (columns - 1);
  const double edge = std::max(drag.cell_m, height / (rows - 1));
  drag.held = {random.Below(4)};
  if (random.Below(3) > 0) drag.held.push_back(columns - 1 - random.Below(4));
  const std::vector<uint32_t> pins = drag.is_gripped ? std::vector<uint32_t>{} : drag.held;
  const StructuralMaterial woven{.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m};
  drag.scene = drag.is_mesh ? MeshedGrid(columns, rows, width, height, pins, woven)
                            : Grid(columns, rows, width, height, pins);
  ClothParameters& parameters = drag.scene.parameters;
  parameters.settings = PresetSettings(Preset::kRealtime);
  parameters.settings.time_step_s = seed % 3 == 0 ? 1.0 / 120 : 1.0 / 60;
  parameters.friction_static = random.In(0.3, 0.6);
  parameters.friction_dynamic = parameters.friction_static * random.In(0.7, 1);
  parameters.thickness_m = random.In(0, 0.004);
  parameters.damping_per_s = 1;
  parameters.max_grips = drag.is_gripped ? 2 : 0;
  const Vector3d corner = seed % 5 == 4 ? Vector3d(40, 5, -30) : Vector3d(0, 0, 0);
  for (Vector3d& p : drag.scene.state.positions_m) p += corner;
  for (const uint32_t i : drag.held) drag.starts.push_back(drag.scene.state.positions_m[i]);
  const double speed = std::pow(10, random.In(-1, 0));
  drag.drag_s = std::min(3.0, random.In(0.3, 0.6) / speed);
  do {
    parameters.colliders = {SharpCollider(seed % 4, corner, width, edge, random)};
    const Vector3d along(random.In(-0.7, 0.7), random.In(-1, 0.7), random.In(-1, 0.2));
    drag.velocity = speed * along.normalized();
  } while (!IsClear(drag, parameters.colliders[0]));
  return drag;
}

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
  const double hit = 7.1 / 4.9 * (drag.velocity.norm() + fall) *
                     std::sqrt(kSigma_kg_per_m2 / kMeshStretchStiffness_n_per_m);
  const double pull = drag.scene.model->total_mass_kg() * parameters.gravity_m_per_s2.norm() *
                      std::exp(parameters.friction_static * std::numbers::pi / 2);
  return hit + pull / (kMeshStretchStiffness_n_per_m * drag.cell_m);
}

// As sharp_collider_test: 5 % is where a warning begins.
TEST_P(DraggedCloth, IsNotCaught) {
  const uint32_t drags = GetParam() == "cpu" ? 32 : 4;
  uint32_t caught = 0;
  for (uint32_t seed = 0; seed < drags; ++seed) {
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
    EXPECT_GE(6 * caught, drags) << "nothing to catch";
  }
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
