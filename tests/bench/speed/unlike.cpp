// What cloths cost that differ in what they hold, in whether their colliders move or in whether
// they are asked for impulses, against as many that do not -> speed_unlike.csv.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/core/check.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/timing.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

using Held = std::vector<uint32_t>;

// Cloths that start every turn from the same states, mid-motion.
class Turns {
 public:
  // `are_asked`: for the impulses of every step.
  Turns(std::unique_ptr<Backend> backend, const std::vector<test::Scene>& scenes, bool are_asked,
        uint32_t lead_steps)
      : backend_(std::move(backend)) {
    grips_.reserve(scenes.size());  // the items refer to them
    for (const test::Scene& scene : scenes) {
      items_.push_back({.cloth = test::CreateCloth(*backend_, scene),
                        .pin_targets_m = {},
                        .grips = grips_.emplace_back(scene.grips),
                        .impulses = are_asked});
    }
    for (uint32_t k = 0; k < lead_steps; ++k) backend_->Step(items_);
    for (size_t k = 0; k < scenes.size(); ++k) {
      ClothUpdate& start = starts_.emplace_back();
      start.state = test::ReadState(*backend_, items_[k].cloth);
      start.collider_motions = scenes[k].parameters.collider_motions;
    }
  }

  // Mean wall time of a step [ms].
  double Turn_ms(uint32_t steps) {
    for (size_t k = 0; k < items_.size(); ++k) {
      const Status status = backend_->Write(items_[k].cloth, starts_[k]);
      DRAPE_CHECK(status.ok(), status.ToString());
    }
    const auto start = std::chrono::steady_clock::now();
    for (uint32_t k = 0; k < steps; ++k) backend_->Step(items_);
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
    return wall.count() / steps;
  }

 private:
  std::unique_ptr<Backend> backend_;
  std::vector<std::vector<Grip>> grips_;
  std::vector<StepItem> items_;
  std::vector<ClothUpdate> starts_;
};

// One thing by which cloths may differ.
struct Difference {
  std::string name;
  // Cloth k of those that differ, or of those that do not.
  std::function<test::Scene(uint32_t side, uint32_t k, bool differs)> make;
  bool is_of_asking = false;  // those that differ are asked for impulses
};

test::Scene Realtime(test::Scene scene) {
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.settings.sleep_motion_m = 0;
  return scene;
}

// Every cloth holds other particles, spread over the cloth and no two of them neighbours, or all
// hold the same.
Held HeldBy(uint32_t side, uint32_t k, uint32_t count, bool differs) {
  Held held;
  const uint32_t particles = side * side;
  for (uint32_t pin = 0; pin < count; ++pin) {
    const uint32_t first = pin * particles / count;
    held.push_back(first + (differs ? k * 37 % (particles / count - side) : 0));
  }
  return held;
}

Difference OfPins(const std::string& name, uint32_t count,
                  const std::function<test::Scene(uint32_t side, const Held& held)>& make) {
  return {name, [=](uint32_t side, uint32_t k, bool differs) {
            return Realtime(make(side, HeldBy(side, k, count, differs)));
          }};
}

test::Scene Sheet(uint32_t side, const Held& held) {
  return test::Grid(side, side, 1, 1, held);
}
test::Scene Fabric(uint32_t side, const Held& held) {
  return test::Grid(side, side, 1, 1, held,
                    {.bending_rigidity_n_m = 1e-5, .shear_modulus_n_per_m = 20});
}
test::Scene Mesh(uint32_t side, const Held& held) {
  return test::MeshedGrid(side, side, 1, 1, held);
}
test::Scene BendingMesh(uint32_t side, const Held& held) {
  return test::MeshedGrid(side, side, 1, 1, held, {.bending_rigidity_n_m = 1e-5});
}

// Sheet k hangs by two pins, and may grip two particles of its own.
test::Scene Gripping(test::Scene (*make)(uint32_t side, const Held& held), uint32_t side,
                     uint32_t k, bool has_grips) {
  test::Scene scene = Realtime(make(side, {0, side - 1}));
  test::GripParticles(scene, {});
  if (!has_grips) return scene;
  const uint32_t first = 2 * side + k * 37 % (side * (side / 2 - 2));
  test::GripParticles(scene, {first, first + side * (side / 2 - 1)});
  return scene;
}

// Sheets that hang by the same two pins; those that differ also grip two particles each.
Difference OfGrips(const std::string& name, test::Scene (*make)(uint32_t side, const Held& held)) {
  return {name, [=](uint32_t side, uint32_t k, bool differs) {
            return Gripping(make, side, k, differs);
          }};
}

// Those that differ are asked for impulses.
Difference OfAsking(const std::string& name, test::Scene (*make)(uint32_t side, const Held& held),
                    bool have_grips) {
  return {name,
          [=](uint32_t side, uint32_t k, bool) { return Gripping(make, side, k, have_grips); },
          true};
}

// The sheets have fallen onto a sphere above a plane, or onto a box and a capsule. Half of the
// colliders that move turn as well.
Difference OfMotions(const std::string& name, double friction, test::Scene (*make)(uint32_t)) {
  return {name, [=](uint32_t side, uint32_t k, bool differs) {
            test::Scene scene = Realtime(make(side));
            scene.parameters.friction_static = scene.parameters.friction_dynamic = friction;
            if (!differs) return scene;
            for (const Collider& collider : scene.parameters.colliders) {
              RigidMotion motion = RigidMotion::AtRest(CentreOf(collider));
              motion.velocity_m_per_s = {0.1 * std::sin(k), 0, 0.1 * std::cos(k)};
              if (k % 2 == 1) motion.angular_velocity_rad_per_s = {0, 0.5, 0.1};
              scene.parameters.collider_motions.push_back(motion);
            }
            return scene;
          }};
}

std::vector<Difference> Differences() {
  return {OfPins("another pin each", 1, Sheet),
          OfPins("two other pins each", 2, Sheet),
          OfPins("another pin each of sheets that bend and shear", 1, Fabric),
          OfPins("another pin each of meshes", 1, Mesh),
          OfPins("another pin each of meshes that bend", 1, BendingMesh),
          OfGrips("two grips each", Sheet),
          OfGrips("two grips each of sheets that bend and shear", Fabric),
          OfAsking("impulses", Sheet, false),
          OfAsking("impulses of two grips each", Sheet, true),
          OfAsking("impulses of two grips each of sheets that bend and shear", Fabric, true),
          OfMotions("sphere and plane that move", 0, test::FallingOnSphere),
          OfMotions("sphere and plane that move with friction", 0.4, test::FallingOnSphere),
          OfMotions("box and capsule that move with friction", 0.4, test::FallingOnBoxAndCapsule)};
}

// Those of these names; of none: all.
std::vector<Difference> ChosenDifferences(const std::vector<std::string>& names) {
  const std::vector<Difference> all = Differences();
  if (names.empty()) return all;
  std::vector<Difference> chosen;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(all, name, &Difference::name);
    if (found == all.end()) {
      std::string legal;
      for (const Difference& difference : all) legal += "\n  " + difference.name;
      throw std::runtime_error("--difference: '" + name + "' is none of" + legal);
    }
    chosen.push_back(*found);
  }
  return chosen;
}

std::vector<test::Scene> ScenesOf(const Difference& difference, uint32_t side, uint32_t cloths,
                                  bool differs) {
  std::vector<test::Scene> scenes;
  std::shared_ptr<const SceneModel> same;
  for (uint32_t k = 0; k < cloths; ++k) {
    scenes.push_back(difference.make(side, k, differs));
    if (same == nullptr) same = scenes[0].model;
    if (same->SameContent(*scenes[k].model)) scenes[k].model = same;
    scenes[k].parameters.gravity_m_per_s2 = MakeBatch(scenes[0], cloths).gravities_m_per_s2[k];
  }
  return scenes;
}

}  // namespace

void MeasureUnlike(Bench& bench, UnlikeOptions options) {
  if (bench.is_quick()) {
    options = {
        .cloths = 4, .sides = {6}, .lead_steps = 1, .rounds = 1, .steps = 1, .only = options.only};
  }
  const std::vector<Difference> differences = ChosenDifferences(options.only);
  Table table = bench.OpenTable(
      "speed_unlike", {"difference", "particles", "cloths", "round", "like_ms", "unlike_ms"});
  for (const Difference& difference : differences) {
    for (const uint32_t side : options.sides) {
      if (!bench.StartRow(difference.name + ", " + std::to_string(side * side) + " particles")) {
        return;
      }
      const auto turns = [&](bool differs) {
        return Turns(test::MakeBackend("cpu"), ScenesOf(difference, side, options.cloths, differs),
                     differs && difference.is_of_asking, options.lead_steps);
      };
      Turns like = turns(false), unlike = turns(true);
      for (uint32_t round = 0; round <= options.rounds; ++round) {
        const double like_ms = like.Turn_ms(options.steps);
        const double unlike_ms = unlike.Turn_ms(options.steps);
        if (round == 0) continue;  // warmed up
        table.Add({difference.name, side * side, options.cloths, round, like_ms, unlike_ms});
      }
    }
  }
}

}  // namespace drape::bench
