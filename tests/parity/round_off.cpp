#include "tests/parity/round_off.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <variant>
#include <vector>

#include "server/scene/distance_map.h"
#include "server/scene/mesh.h"
#include "server/solver/force_limits.h"
#include "server/solver/solver_constants.h"
#include "tests/support/backends/backends.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kRoundOff = 0x1p-24;
// Starts that differ by no more roundings of the coordinates than gaps do (kTouchRoundOffs), and
// how many of them are tried.
constexpr double kEqualStarts = kTouchRoundOffs;
constexpr int kStartsTried = 32;

// The constraints and springs of the busiest particle.
struct Coupling {
  double degree = 0;
  double length_m = 0;
  double spring_rate = 0;   // sum of k/m over its springs [1/s^2]
  double spring_decay = 0;  // sum of c/m [1/s]
};

Coupling FindCoupling(const SceneModel& model) {
  Coupling coupling;
  std::vector<double> degrees(model.particle_count());
  const auto w = model.inverse_masses_per_kg();
  for (const DistanceConstraint& constraint : model.constraints()) {
    ++degrees[constraint.i];
    ++degrees[constraint.j];
    coupling.length_m = std::max(coupling.length_m, constraint.rest_length_m);
  }
  for (const PointJoint& joint : model.joints()) {
    ++degrees[joint.i];
    ++degrees[joint.j];
  }
  for (const Spring& spring : model.springs()) {
    coupling.length_m = std::max(coupling.length_m, spring.rest_length_m);
  }
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    coupling.degree = std::max(coupling.degree, degrees[i]);
    double rate = 0, decay = 0;
    for (uint32_t e = model.spring_offsets()[i]; e < model.spring_offsets()[i + 1]; ++e) {
      rate += model.spring_ends()[e].stiffness_n_per_m * w[i];
      decay += model.spring_ends()[e].damping_n_s_per_m * w[i];
    }
    coupling.spring_rate = std::max(coupling.spring_rate, rate);
    coupling.spring_decay = std::max(coupling.spring_decay, decay);
  }
  return coupling;
}

// Radius of the surface at which particles are held, if it is curved. Around the edges of a box and
// the rims of a cylinder that is the cloth's thickness; the scenes of these tests bring no particle
// nearer to an edge than half of it.
struct CurvatureRadius {
  double thickness_m;
  double flat;

  double operator()(const SphereShape& sphere) const { return sphere.radius_m; }
  double operator()(const PlaneShape&) const { return flat; }
  double operator()(const CapsuleShape& capsule) const { return capsule.radius_m; }
  double operator()(const CylinderShape& cylinder) const {
    return thickness_m > 0 ? std::min(thickness_m / 2, cylinder.radius_m) : cylinder.radius_m;
  }
  double operator()(const BoxShape&) const { return thickness_m > 0 ? thickness_m / 2 : flat; }
  // Distances of neighbouring samples differ by at most a cell, so that within a cell each
  // component of the gradient changes by at most 2 per cell along the two other axes: in all by 2
  // sqrt(6) per cell, and its direction by twice that, because these tests keep to gradients of at
  // least 1/2.
  double operator()(const DistanceMapShape& solid) const { return solid.map->cell_m() / 10; }
};

// Scales of the air's effect on the triangles.
struct AirScales {
  double ratio = 0;  // largest share of its relative velocity that a triangle loses in a kick
  double edge_m = 1;
};

AirScales FindAirScales(const Scene& scene, double relative_speed) {
  const SceneModel& model = *scene.model;
  const ClothParameters& parameters = scene.parameters;
  AirScales scales;
  if (parameters.air_drag == 0 && parameters.air_lift == 0) return scales;
  scales.edge_m = std::numeric_limits<double>::infinity();
  const double per_area = parameters.settings.substep_s() * kAirDensity_kg_per_m3 *
                          (parameters.air_drag + parameters.air_lift) * relative_speed / 2;
  for (size_t t = 0; t < model.triangles().size(); ++t) {
    const auto& [i, j, k] = model.triangles()[t];
    const auto p = model.rest_positions_m();
    scales.ratio = std::max(scales.ratio, 2 * TriangleArea(p[i], p[j], p[k]) * per_area /
                                              model.triangle_masses_kg()[t]);
    scales.edge_m = std::min({scales.edge_m, (p[i] - p[j]).norm(), (p[j] - p[k]).norm()});
  }
  scales.ratio = std::min(scales.ratio, 1.0);
  return scales;
}

// Scales of the elastic elements of the busiest particle.
struct ElasticScales {
  double rate = 0;   // change of velocity per second and displacement [1/s^2]
  double decay = 0;  // and per speed [1/s]
  double length_m = 0;
};

ElasticScales FindElasticScales(const Scene& scene) {
  const SceneModel& model = *scene.model;
  ElasticScales scales;
  if (model.elastic_count() == 0) return scales;
  const double h = scene.parameters.settings.substep_s();
  const StepPlan plan = PlanOf(scene);
  const double limit =
      plan.solver.has_elastic_lines ? 1 / (h * h) : plan.max_elastic_frequency_sq_per_s2;
  std::vector<double> rates(model.particle_count()), decays(model.particle_count());
  for (uint32_t e = 0; e < model.elastic_count(); ++e) {
    const auto& [particles, weights, rest_length, stiffness, damping] = model.elastic_elements()[e];
    const double frequency_sq = model.elastic_shares().frequencies_sq_per_s2[e];
    const double mass = model.elastic_shares().masses_kg[e];
    double all_weights = 0;
    for (const double weight : weights) all_weights += std::abs(weight);
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t i = particles[k];
      const double gain =
          model.inverse_masses_per_kg()[i] * std::abs(weights[k]) * mass * all_weights;
      rates[i] += gain * std::min(frequency_sq, limit);
      decays[i] += gain * damping / h;
      const Vector3d side = model.rest_positions_m()[i] - model.rest_positions_m()[particles[0]];
      scales.length_m = std::max(scales.length_m, side.norm());
    }
  }
  scales.rate = *std::max_element(rates.begin(), rates.end());
  scales.decay = *std::max_element(decays.begin(), decays.end());
  return scales;
}

double SmallestRadius(const ClothParameters& parameters, double otherwise) {
  double radius = otherwise;
  for (const Collider& collider : parameters.colliders) {
    radius = std::min(
        radius, std::visit(CurvatureRadius{parameters.thickness_m, otherwise}, collider.shape));
  }
  return radius;
}

// Largest coordinate that enters a distance.
struct Extent {
  const RigidTransform& pose;

  double operator()(const SphereShape& sphere) const {
    return pose.position_m.norm() + sphere.radius_m;
  }
  double operator()(const PlaneShape&) const { return pose.position_m.norm(); }
  double operator()(const CapsuleShape& capsule) const {
    return std::max((pose * capsule.a_m).norm(), (pose * capsule.b_m).norm()) + capsule.radius_m;
  }
  double operator()(const CylinderShape& cylinder) const {
    return std::max((pose * cylinder.a_m).norm(), (pose * cylinder.b_m).norm()) + cylinder.radius_m;
  }
  double operator()(const BoxShape& box) const {
    return pose.position_m.norm() + box.half_extents_m.norm();
  }
  double operator()(const DistanceMapShape& solid) const {
    return pose.position_m.norm() + std::max(solid.map->low_m().norm(), solid.map->high_m().norm());
  }
};

// Roundings of one contact: of size X in its gap, of size X in the position that gives its
// direction, and relative ones of that direction. Single precision leaves a particle on the surface
// where it is: the coordinates of the particle and of the collider add up to 2 sqrt(3) X at most.
struct ContactRoundings {
  static constexpr double kTouch = 4 * kTouchRoundOffs;

  double gap = 8 + kTouch;
  double place = 2;
  double direction = 4;
};

ContactRoundings RoundingsOf(const ClothParameters& parameters) {
  const bool has_map = std::ranges::any_of(parameters.colliders, [](const Collider& collider) {
    return collider.kind() == ShapeKind::kDistanceMap;
  });
  return has_map ? ContactRoundings{72 + ContactRoundings::kTouch, 32, 48} : ContactRoundings{};
}

double ColliderExtent(const ClothParameters& parameters) {
  double extent = 0;
  for (const Collider& collider : parameters.colliders) {
    extent = std::max(extent, std::visit(Extent{collider.pose}, collider.shape));
  }
  return extent;
}

// Largest speed of points of colliders within `extent` of the origin; 0 if they rest.
double LargestSurfaceSpeed(const ClothParameters& parameters, double extent) {
  double speed = 0;
  for (const RigidMotion& motion : parameters.collider_motions) {
    speed = std::max(speed, motion.velocity_m_per_s.norm() +
                                2 * extent * motion.angular_velocity_rad_per_s.norm());
  }
  return speed;
}

double LongestStrip(const SceneModel& model) {
  const std::vector<uint32_t>& offsets = model.strips().strip_offsets;
  uint32_t longest = 0;
  for (size_t s = 0; s + 1 < offsets.size(); ++s) {
    longest = std::max(longest, offsets[s + 1] - offsets[s]);
  }
  return longest;
}

double LargestNorm(const std::vector<Vector3d>& vectors) {
  double largest = 0;
  for (const Vector3d& v : vectors) largest = std::max(largest, v.norm());
  return largest;
}

void Widen(RunScales& scales, const ParticleState& state) {
  scales.coordinate_m = std::max(scales.coordinate_m, LargestNorm(state.positions_m));
  scales.speed_m_per_s = std::max(scales.speed_m_per_s, LargestNorm(state.velocities_m_per_s));
}

void CompareReports(const StepReport& actual, const StepReport& expected, bool has_tolerance) {
  EXPECT_EQ(actual.fault, expected.fault);
  EXPECT_EQ(actual.warnings.springs_beyond_limit, expected.warnings.springs_beyond_limit);
  EXPECT_EQ(actual.warnings.elastic_beyond_limit, expected.warnings.elastic_beyond_limit);
  EXPECT_EQ(actual.warnings.strain_beyond_limit, expected.warnings.strain_beyond_limit);
  EXPECT_EQ(actual.converged, expected.converged);
  EXPECT_EQ(actual.warnings.not_converged, expected.warnings.not_converged);
  if (!has_tolerance) {
    EXPECT_EQ(actual.iterations, expected.iterations);
  }
}

bool AreNear(const ParticleState& actual, const ParticleState& expected, const ErrorBound& bound) {
  return FindWorst(actual.positions_m, expected.positions_m).distance <= bound.position_m &&
         FindWorst(actual.velocities_m_per_s, expected.velocities_m_per_s).distance <=
             bound.velocity_m_per_s;
}

// Whether some start that differs from the scene's by rounding leads the reference near this state
// (backward stability: Higham, section 1.5). Only where hits are events: within rounding, a
// particle rebounds in one substep or in the next.
bool IsNearOfAnEqualStart(const ParticleState& actual, const Scene& scene, uint32_t steps,
                          const ErrorBound& bound, double extent) {
  if (scene.parameters.restitution == 0) return false;
  Backend& reference = SharedBackend("reference");
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> noise_m(-kEqualStarts * kRoundOff * extent,
                                                 kEqualStarts * kRoundOff * extent);
  for (int start = 0; start < kStartsTried; ++start) {
    Scene equal = scene;
    for (Vector3d& p : equal.state.positions_m) {
      for (int axis = 0; axis < 3; ++axis) p[axis] += noise_m(generator);
    }
    const ClothHandle cloth = CreateCloth(reference, equal);
    StepAlone(reference, cloth, equal, steps);
    const bool is_near = AreNear(actual, ReadState(reference, cloth), bound);
    reference.Destroy(cloth);
    if (is_near) return true;
  }
  return false;
}

void CompareStates(const ParticleState& actual, const ParticleState& expected,
                   const ErrorBound& bound) {
  const WorstOffender position = FindWorst(actual.positions_m, expected.positions_m);
  EXPECT_LE(position.distance, bound.position_m) << "position [m], " << position.message;
  const WorstOffender velocity = FindWorst(actual.velocities_m_per_s, expected.velocities_m_per_s);
  EXPECT_LE(velocity.distance, bound.velocity_m_per_s) << "velocity [m/s], " << velocity.message;
}

}  // namespace

ErrorBound RoundOffBound(const Scene& scene, const RunScales& scales, uint32_t substeps,
                         uint32_t sweeps, bool has_reduction) {
  const Coupling coupling = FindCoupling(*scene.model);
  const double h = scene.parameters.settings.substep_s();
  const double speed = scales.speed_m_per_s + scales.acceleration_m_per_s2 * h;
  const double extent = std::max(scales.coordinate_m, ColliderExtent(scene.parameters));
  const double radius = SmallestRadius(scene.parameters, extent);
  const double colliders = static_cast<double>(scene.parameters.colliders.size());
  const double count = substeps;

  const SolverChoice solver = PlanOf(scene).solver;
  // Along start directions: a second unit vector (8), the mean of the two and its slope (5); in
  // strips one more coupling per link.
  const bool has_starts = solver.end_share < 1;
  const double of_a_link = has_starts ? 26 : 13;
  // Effects of unlike signs add four to the roundings of a level.
  const double of_elimination = has_starts ? 12 : 8;
  const double of_reduction = has_starts ? 39 : 35;
  const double of_a_strip =
      (has_reduction ? of_reduction : of_elimination) * LongestStrip(*scene.model);
  const double roundings = of_a_link + (solver.has_strips ? of_a_strip : 0);
  const double constraint = kRoundOff * (roundings * (coupling.length_m + h * speed) / h + speed);
  const ContactRoundings of = RoundingsOf(scene.parameters);
  const double moving = HasMovingColliders(scene.parameters) ? 24 : 0;
  const double contact = kRoundOff * ((of.gap + moving) * extent / h +
                                      (of.place * extent / radius + of.direction) * speed +
                                      12 * LargestSurfaceSpeed(scene.parameters, extent));
  const double sweep = coupling.degree * constraint + colliders * contact;
  const double position = kRoundOff * extent;
  // Once in a step the refinement sweeps over links.
  const double steps = std::ceil(count / scene.parameters.settings.substeps);
  const double refined_sweeps = sweeps + steps * solver.refine_rounds * kRefineSweeps;
  const double held =
      std::sqrt(refined_sweeps / count) * sweep + (coupling.degree + colliders) * 2 * position / h;
  const double spring = kRoundOff * 8 * h *
                        (coupling.spring_rate * coupling.length_m + coupling.spring_decay * speed);
  const double air_speed = scene.parameters.wind_m_per_s.norm() + speed;
  const AirScales air = FindAirScales(scene, air_speed);
  const double kick = air.ratio * air_speed * (48 * kRoundOff + 8 * count * position / air.edge_m);
  const ElasticScales elastic_scales = FindElasticScales(scene);
  const double elastic =
      elastic_scales.length_m > 0
          ? h * elastic_scales.rate *
                    (16 * kRoundOff * elastic_scales.length_m + 2 * count * position) +
                h * elastic_scales.decay * speed *
                    (16 * kRoundOff + 2 * count * position / elastic_scales.length_m)
          : 0;
  // A line's solution x, at most the speed, is exact for a matrix near its own, M + s K: each entry
  // is rounded when it is stored, and by the three products of each pass (Higham, «Accuracy and
  // Stability of Numerical Algorithms», section 9.3). (M + s K)^-1 is at most M^-1, so that changes
  // x by at most as many roundings of (s K / M) x. The dual of it holds for diagonals and cells.
  const double line_ratio = std::min(ElasticRatio(*scene.model, scene.parameters), kMaxLineRatio);
  const double lines =
      PlanOf(scene).solver.has_elastic_lines ? 8 * kRoundOff * line_ratio * speed : 0;
  // A rounding of a stage's force grows to at most as many times its size as stages are left; with
  // their gains that adds up to less than 3 (Sommeijer, Shampine and Verwer 1997, "RKC: an explicit
  // solver for parabolic PDEs", internal stability).
  const double kicks = PlanOf(scene).solver.hinge_stages > 0 ? 3 : 2;
  const double free = 8 * kRoundOff * speed + 2 * spring + kicks * elastic + lines + 2 * kick;

  // The velocity stage adds sweeps of the same size.
  const double growth = (solver.has_two_steps ? 1.5 : 1) * (1 + solver.velocity_iterations);
  ErrorBound bound;
  bound.velocity_m_per_s = growth * (std::sqrt(count) * held + count * free);
  bound.position_m = count * position + h * count * bound.velocity_m_per_s;
  return bound;
}

void ExpectParity(const std::string& backend_name, Scene scene, uint32_t steps,
                  uint32_t path_links) {
  SCOPED_TRACE(scene.name + " on " + backend_name);
  RoundToFloat(scene.state.positions_m);
  RoundToFloat(scene.state.velocities_m_per_s);
  RoundToFloat(scene.pin_targets_m);
  for (Grip& grip : scene.grips) grip.target_m = RoundToFloat(grip.target_m);
  Backend& reference = SharedBackend("reference");
  Backend& backend = SharedBackend(backend_name);
  const ClothHandle expected_cloth = CreateCloth(reference, scene);
  const ClothHandle actual_cloth = CreateCloth(backend, scene);

  const double tolerance = scene.parameters.settings.tolerance;
  RunScales scales;
  uint32_t sweeps = 0;
  scales.acceleration_m_per_s2 = scene.parameters.gravity_m_per_s2.norm();
  Widen(scales, scene.state);
  for (uint32_t step = 1; step <= steps; ++step) {
    SCOPED_TRACE("after step " + std::to_string(step));
    const StepReport expected_report = StepAlone(reference, expected_cloth, scene);
    const StepReport actual_report = StepAlone(backend, actual_cloth, scene);
    const ParticleState expected = ReadState(reference, expected_cloth);
    Widen(scales, expected);
    sweeps += expected_report.iterations;
    ErrorBound bound = RoundOffBound(scene, scales, step * scene.parameters.settings.substeps,
                                     sweeps, HasReduction(backend));
    const double accepted = 2 * tolerance * FindCoupling(*scene.model).length_m * path_links;
    bound.position_m += accepted;
    bound.velocity_m_per_s += accepted / scene.parameters.settings.substep_s();
    CompareReports(actual_report, expected_report, tolerance > 0);
    const ParticleState actual = ReadState(backend, actual_cloth);
    if (!AreNear(actual, expected, bound) &&
        IsNearOfAnEqualStart(actual, scene, step, bound,
                             std::max(scales.coordinate_m, ColliderExtent(scene.parameters)))) {
      continue;
    }
    CompareStates(actual, expected, bound);
  }
  reference.Destroy(expected_cloth);
  backend.Destroy(actual_cloth);
}

}  // namespace drape::test
