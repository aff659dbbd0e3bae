// What is held drags a cloth over something that rests, and holds still then: the cloth comes to
// rest.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>
#include <vector>

#include "tests/physics/physics_test.h"
#include "tests/physics/random_drag.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// With damping 2/s swings die out as exp(-t): to less than 1e-3 mm per frame^2.
constexpr double kSettle_s = 14;
constexpr double kWatch_s = 1;
constexpr double kFrame_s = 1.0 / 60;

// The same as of hung cloths (rest_test).
constexpr double kMaxTremble_m = 5e-5;
// Of meshes, whose rounding remainders make up for.
constexpr double kMaxTrembleOfMesh_m = 1e-5;

class DraggedRest : public PhysicsTest {
 protected:
  void Step(ClothHandle cloth, const Drag& drag, double since_s) {
    const std::vector<Grip> held = drag.HeldAt(since_s);
    std::vector<Vector3d> targets;
    for (const Grip& grip : held) targets.push_back(grip.target_m);
    StepItem item{cloth, {}};
    if (drag.is_gripped) {
      item.grips = held;
    } else {
      item.pin_targets_m = targets;
    }
    EXPECT_EQ(backend().Step({&item, 1}).reports[0].fault, FaultReason::kNone);
  }

  // The largest second difference of any particle over frames, once the cloth should be at rest
  // [m].
  double Tremble(const Drag& drag) {
    const ClothHandle cloth = Make(drag.scene);
    const double step_s = drag.scene.parameters.settings.time_step_s;
    const auto frame = std::max(1, static_cast<int>(std::lround(kFrame_s / step_s)));
    const auto settled =
        static_cast<int>(std::lround((drag.settle_s + drag.drag_s + kSettle_s) / step_s));
    const int end = settled + static_cast<int>(std::lround(kWatch_s / step_s));
    std::vector<Vector3d> before, now;
    double largest_m = 0;
    for (int step = 1; step <= end; ++step) {
      Step(cloth, drag, step * step_s - drag.settle_s);
      if (step < settled || (step - settled) % frame != 0) continue;
      std::vector<Vector3d> next = ReadState(backend(), cloth).positions_m;
      for (size_t i = 0; i < before.size(); ++i) {
        largest_m = std::max(largest_m, (next[i] - 2 * now[i] + before[i]).norm());
      }
      before = std::exchange(now, std::move(next));
    }
    return largest_m;
  }

  void ExpectRest(const std::vector<uint32_t>& seeds) {
    for (const uint32_t seed : seeds) {
      SCOPED_TRACE(seed);
      const Drag drag = RandomDragToRest(seed);
      const double tremble_m = Tremble(drag);
      std::printf("[ MEASURED ] rest after drag %u of a %s on %s: %.4f mm\n", seed,
                  drag.is_mesh ? "mesh" : "grid", backend_name().c_str(), 1e3 * tremble_m);
      EXPECT_LE(tremble_m, drag.is_mesh ? kMaxTrembleOfMesh_m : kMaxTremble_m);
    }
  }
};

TEST_P(DraggedRest, WhenWhatIsHeldHoldsStill) {
  // A mesh in steps of 1/30 s, the cheapest; on cpu more, of both kinds.
  if (backend_name() == "cpu") {
    ExpectRest({6, 7, 9, 11, 12, 15});
  } else {
    ExpectRest({11});
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(DraggedRest);

using DraggedRestLong = DraggedRest;

TEST_P(DraggedRestLong, OfManyCloths) {
  std::vector<uint32_t> seeds(40);
  std::iota(seeds.begin(), seeds.end(), 100);
  ExpectRest(seeds);
}

INSTANTIATE_TEST_SUITE_P(Backends, DraggedRestLong, testing::Values("cpu"),
                         [](const auto& one) { return one.param; });

}  // namespace
}  // namespace drape::test
