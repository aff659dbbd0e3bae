// Invariants of elements of bending and shear at any strength and step: momentum, angular momentum,
// and no gain of energy.
#include <algorithm>
#include <cmath>
#include <vector>

#include "server/solver/force_limits.h"
#include "server/solver/hinge_stages.h"
#include "server/solver/solver_constants.h"
#include "tests/physics/preset_test.h"
#include "tests/support/garments.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Edges so soft that they do nothing.
constexpr double kNoStretching_m_per_n = 1e12;

struct Sums {
  Vector3d momentum = Vector3d::Zero();
  Vector3d angular = Vector3d::Zero();
  double kinetic_j = 0;
};

Sums SumsOf(const SceneModel& model, const ParticleState& state) {
  Sums sums;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    const Vector3d p = model.masses_kg()[i] * state.velocities_m_per_s[i];
    sums.momentum += p;
    sums.angular += state.positions_m[i].cross(p);
    sums.kinetic_j += p.dot(state.velocities_m_per_s[i]) / 2;
  }
  return sums;
}

// With this share of the requested stiffness.
double ElasticEnergy_j(const SceneModel& model, const ParticleState& state, double share) {
  double energy_j = 0;
  for (const ElasticElement& element : model.elastic_elements()) {
    const double deflection_m =
        DeflectionOf_m(element, [&](uint32_t i) { return state.positions_m[i]; });
    energy_j += share * element.stiffness_n_per_m / 2 * std::pow(deflection_m, 2);
  }
  return energy_j;
}

// Largest 4 sum of c_j x R_(j-1)^2 of a mode x, c_j the part that stage j has in the change of the
// velocities and R_j what is left after it, and at least 5.
double TurningOfStages(uint32_t count) {
  const std::vector<HingeStage> stages = HingeStages(count);
  double largest = 5;
  for (double x = 0; x <= LargestHingeRatio(count); x += LargestHingeRatio(count) / 1e3) {
    double left = 1, change = 0, sum = 0;
    for (size_t j = 0; j < stages.size(); ++j) {
      double part = stages[j].gain, goes_on = stages[j].gain;
      for (size_t k = j + 1; k < stages.size(); ++k) part += goes_on *= stages[k].momentum;
      sum += part * x * left * left;
      change = stages[j].momentum * change - stages[j].gain * x * left;
      left += change;
    }
    largest = std::max(largest, 4 * sum);
  }
  return largest;
}

// A grid of both elements, and a mesh that is curved at rest; crumpled, moving, free, weightless.
Scene Crumpled(bool is_mesh, double strength) {
  ModelDescription description;
  if (is_mesh) {
    TriangleMesh mesh;
    constexpr uint32_t kSide = 6;
    for (uint32_t i = 0; i < kSide * kSide; ++i) {
      const double x = i % kSide * 0.1, z = i / kSide * 0.1;
      mesh.positions_m.emplace_back(x, 0.3 * x * x + 0.1 * std::sin(7 * z), z);
      if (i % kSide + 1 == kSide || i / kSide + 1 == kSide) continue;
      mesh.triangles.push_back({i, i + kSide, i + 1});
      mesh.triangles.push_back({i + 1, i + kSide, i + kSide + 1});
    }
    description.topology = mesh;
  } else {
    description.topology = GridTopology{7, 5, 0.6, 0.4};
    description.material.shear_modulus_n_per_m = 1e3 * strength;
  }
  description.material.stretch_compliance_m_per_n = kNoStretching_m_per_n;
  description.material.bending_rigidity_n_m = strength;
  Scene scene;
  scene.name = is_mesh ? "mesh" : "grid";
  scene.model = BuildModel(description);
  scene.state = RestState(*scene.model);
  scene.parameters.gravity_m_per_s2.setZero();
  for (Vector3d& p : scene.state.positions_m) {
    p.y() += 0.03 * std::sin(23 * p.x() + 31 * p.z());
    p.x() += 0.01 * std::cos(17 * p.z());
  }
  Stir(scene, 0.5);
  return scene;
}

class ElasticInvariants : public PhysicsTest {};

// All impulses of an element add up to 0 and, in kicks, point along L, the weighted sum of the
// positions, so they have neither momentum nor angular momentum. ONE_STEP, as two steps keep
// neither exactly for anything. Each impulse is rounded a few times relative to its size, at most
// (stiffness) h l at a weight of 2; the largest of l, of a rounding of positions, is bounded by the
// speeds that come of it.
//
// Lines: the solution x of a line of rods is that of a matrix rounded in each entry, of size M (1 +
// ratio): momentum is rounded by that instead of M. Impulses J point along L at the end, L + h U: J
// has the torque h |U x J| about the start. With J = h k |L + h U|, the sum over the elements of a
// family is at most h sum of (k |L + h U|^2 + k |h U|^2) / 2, and an implicit step makes that at
// most h times the energy, elastic and kinetic, before it.
//
// Stages: J points along L where the stage finds the particles, L_j + h U_j, so it has the torque
// h |U_j x J|, at most h (k |L_j + h U_j|^2 + k |h U_j|^2) / 2. A mode of deflection y and speed v
// has y_j = R_j (y + h v) there, and h U_j = y_j - y: in all at most h (2 + 2 (8/7)^2) < 5 h times
// the elastic energy before, and 4 h sum of c_j x R_j^2 times the kinetic one (TurningOfStages).
TEST_P(ElasticInvariants, MomentumAndAngularMomentum) {
  for (const bool is_mesh : {false, true}) {
    for (const double strength : {1e-4, 1.0, 1e6}) {
      Scene scene = Crumpled(is_mesh, strength);
      SCOPED_TRACE(scene.name + " " + std::to_string(strength));
      scene.parameters.settings = SingleSubstep(1.0 / 240);
      const StepPlan plan = PlanOf(scene);
      const bool has_lines = plan.solver.has_elastic_lines;
      const uint32_t stages = plan.solver.hinge_stages;
      EXPECT_EQ(has_lines, !is_mesh && strength >= 1);
      EXPECT_EQ(stages > 0, is_mesh && strength >= 1);
      const double ratio = has_lines ? ElasticRatio(*scene.model, scene.parameters) : 0;
      const double share =
          std::min(1.0, plan.max_elastic_frequency_sq_per_s2 /
                            std::max(scene.model->elastic_frequency_sq_bound(), 1.0));
      const double turns = stages > 0
                               ? TurningOfStages(stages)
                               : static_cast<double>(scene.model->elastic_lines().families.size());
      constexpr uint32_t kSteps = 20;
      const ClothHandle cloth = Make(scene);
      const Sums before = SumsOf(*scene.model, scene.state);
      double fastest = 0, turning = 0;
      for (uint32_t step = 0; step < kSteps; ++step) {
        const ParticleState state = ReadState(backend(), cloth);
        turning +=
            scene.parameters.settings.time_step_s * turns *
            (SumsOf(*scene.model, state).kinetic_j + ElasticEnergy_j(*scene.model, state, share));
        const StepReport report = StepAlone(backend(), cloth, scene);
        EXPECT_EQ(report.fault, FaultReason::kNone);
        EXPECT_EQ(report.warnings.elastic_beyond_limit, strength >= 1e6);
        for (const Vector3d& v : ReadState(backend(), cloth).velocities_m_per_s) {
          fastest = std::max(fastest, v.norm());
        }
      }
      const Sums after = SumsOf(*scene.model, ReadState(backend(), cloth));
      // Two kicks per step, or as many as there are stages, 60 roundings of a change of velocity of
      // at most 2 `fastest` on each of at most 30 elements of a particle; places are within 1 m.
      const double mass = scene.model->masses_kg()[0] * scene.model->particle_count() * 2;
      const double bound = kSteps * std::max(2u, stages) * 60 * round_off() * 2 * fastest * mass *
                           (1 + std::min(ratio, kMaxLineRatio));
      EXPECT_LE((after.momentum - before.momentum).norm(), bound);
      EXPECT_LE((after.angular - before.angular).norm(),
                bound + (has_lines || stages > 0 ? turning : 0));
    }
  }
}

class ElasticEnergy : public PresetTest {
 protected:
  // The largest energy after any of so many steps over that before them, of what has rest length 0.
  double LargestEnergyShare(const Scene& scene, uint32_t steps) {
    const auto energy_j = [&](const ParticleState& state) {
      return SumsOf(*scene.model, state).kinetic_j + ElasticEnergy_j(*scene.model, state, 1);
    };
    const ClothHandle cloth = Make(scene);
    double largest_j = 0;
    for (uint32_t step = 0; step < steps; ++step) {
      EXPECT_EQ(StepAlone(backend(), cloth, scene).fault, FaultReason::kNone);
      largest_j = std::max(largest_j, energy_j(ReadState(backend(), cloth)));
    }
    return largest_j / energy_j(scene.state);
  }
};

// A flat sheet has no elastic energy and gets all of it from its motion. Whatever the strength and
// the step: where the elements have h^2 omega^2 <= 1, the Verlet steps of the linear ones keep v.v
// / 2 + p.K p' / 2 (p, p' before and after a drift), at least v.v (1 - 1/4) / 2: the kinetic energy
// never exceeds 4/3 of what it was. Two steps, the damping of diagonals, and lines only take.
TEST_P(ElasticEnergy, AbsurdStrengthGivesNoEnergy) {
  for (const double rigidity : {1e-3, 1.0, 1e6}) {
    for (const double shear : {0.0, 1e3, 1e15}) {
      for (const uint32_t substeps : {1u, 7u}) {
        SCOPED_TRACE(std::to_string(rigidity) + " N m, " + std::to_string(shear) + " N/m, " +
                     std::to_string(substeps));
        Scene scene = Grid(9, 8, 0.8, 0.7, {},
                           {.bending_rigidity_n_m = rigidity, .shear_modulus_n_per_m = shear});
        Stir(scene, 2);
        scene.parameters.gravity_m_per_s2.setZero();
        scene.parameters.settings = PresetSettings(preset());
        scene.parameters.settings.substeps = substeps;
        const double before = SumsOf(*scene.model, scene.state).kinetic_j;
        double largest = 0;
        const ClothHandle cloth = Make(scene);
        for (uint32_t step = 0; step < 60; ++step) {
          EXPECT_EQ(StepAlone(backend(), cloth, scene).fault, FaultReason::kNone);
          largest = std::max(largest,
                             SumsOf(*scene.model, ReadState(backend(), cloth)).kinetic_j / before);
        }
        EXPECT_LE(largest, 4.0 / 3);
      }
    }
  }
}

// The same of a mesh. Of a mode the stages leave the share R, between -1/7 and 1, and links only
// take.
TEST_P(ElasticEnergy, AbsurdStrengthOfHingesGivesNoEnergy) {
  for (const double rigidity : {1e-3, 1.0, 1e3, 1e6}) {
    for (const uint32_t substeps : {1u, 7u}) {
      SCOPED_TRACE(std::to_string(rigidity) + " N m, " + std::to_string(substeps));
      Scene scene = MeshedGrid(9, 8, 0.8, 0.7, {}, {.bending_rigidity_n_m = rigidity});
      Stir(scene, 2);
      scene.parameters.gravity_m_per_s2.setZero();
      scene.parameters.settings = PresetSettings(preset());
      scene.parameters.settings.substeps = substeps;
      const double before = SumsOf(*scene.model, scene.state).kinetic_j;
      double largest = 0;
      const ClothHandle cloth = Make(scene);
      for (uint32_t step = 0; step < 60; ++step) {
        EXPECT_EQ(StepAlone(backend(), cloth, scene).fault, FaultReason::kNone);
        largest =
            std::max(largest, SumsOf(*scene.model, ReadState(backend(), cloth)).kinetic_j / before);
      }
      EXPECT_LE(largest, 4.0 / 3);
    }
  }
}

// Hinges whose forces several substeps share, as fast as may be (kMaxSharedHingeRatio): small
// motions never have more than 1.05^2 of the energy that they began with (substep_schedule_test).
// Large ones are no worse: links and folds only take.
TEST_P(ElasticEnergy, SharedForcesOfHingesGiveNoEnergy) {
  const Eigen::AngleAxisd turn(1.2, Vector3d(1, -2, 2).normalized());
  constexpr uint32_t kSubsteps[] = {10, 9, 8};  // two, three, four share
  for (const uint32_t period : {2u, 3u, 4u}) {
    for (const double time_step_s : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
      for (const uint32_t seed : {1u, 2u, 3u}) {
        const auto sheet = [&](double rigidity_n_m) {
          Scene scene = IrregularSheet({.seed = seed,
                                        .cell_m = 0.1,
                                        .bending_rigidity_n_m = rigidity_n_m,
                                        .transform = {{2, 5, -3}, Eigen::Quaterniond(turn)}});
          scene.parameters.settings = PresetSettings(preset());
          scene.parameters.settings.time_step_s = time_step_s;
          scene.parameters.settings.substeps = kSubsteps[period - 2];
          scene.parameters.gravity_m_per_s2.setZero();
          scene.parameters.damping_per_s = 0;
          return scene;
        };
        const Scene soft = sheet(1e-6);
        const double ratio = ElasticRatio(*soft.model, soft.parameters) * period * period;
        Scene scene = sheet(1e-6 * 0.999 * kMaxSharedHingeRatio / ratio);
        SCOPED_TRACE(std::to_string(period) + " share, " + std::to_string(time_step_s) +
                     " s, seed " + std::to_string(seed));
        const bool has_two_steps = PlanOf(scene).solver.has_two_steps;
        EXPECT_EQ(PlanOf(scene).solver.hinge_period, has_two_steps ? period : 1);
        Stir(scene, 0.5);
        EXPECT_LE(LargestEnergyShare(scene, 40), 1.05 * 1.05);
      }
    }
  }
}

}  // namespace

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(ElasticInvariants);
DRAPE_PRESET_TEST_ON_EVERY_BACKEND(ElasticEnergy);

}  // namespace drape::test
