// The parameters of one cloth in single precision, with everything that follows from them once.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/solver/bodies/body_numbers.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/cpu/formulas/distance_map_gap.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/energy_watch.h"
#include "server/solver/step_plan.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Where a collider is: what of ColliderNumbers moves with it.
struct FloatPlace {
  Vec4 point;
  Vec4 vector;
  std::array<Vec4, 3> axes{};
};

// ColliderNumbers in single precision.
struct FloatCollider {
  ShapeKind kind;
  FloatPlace place;           // as described
  float offset;               // its radius and the cloth's thickness
  DistanceSamples samples{};  // of a distance map
  float size = 0;             // of the point's coordinates, added up [m]
};

// Limits of a link's squared length, relative to the square of its rest length.
struct RefineLimits {
  explicit RefineLimits(double strain)
      : min_sq(static_cast<float>((1 - strain) * (1 - strain))),
        max_sq(static_cast<float>((1 + strain) * (1 + strain))) {}

  float min_sq;
  float max_sq;
};

// HingeStage in single precision.
struct FloatHingeStage {
  float momentum;
  float gain;
};

// A function of the cloth's model and parameters alone.
struct FloatControls {
  FloatControls(const FloatModel& model, const ClothParameters& parameters, bool has_own_lengths);

  // Whether the stage has anything to do.
  bool Has(StepStage stage) const { return plan.Has(stage); }
  bool has_start_directions() const { return end_share < 1; }

  StepPlan plan;
  EnergyLimit energy_limit;
  double damping_per_s;
  double thickness_m;
  double time_step_s;
  float time_step;               // [s]
  float h;                       // substep [s]
  float inverse_h;               // [1/s]
  float tolerance;               // relative to the rest length; 0 = fixed number of sweeps
  RefineLimits refine_limits;    // within them a link is not refined
  float contact_tolerance;       // [m]
  float depenetration_distance;  // [m] per substep
  float friction_static;
  float friction_dynamic;
  bool touches_itself;
  SelfContactNumbers contact;  // with itself, and with cloths of its world
  bool has_restitution;
  float restitution;
  float slowest_rebound;  // [m/s]
  float slowest_landing;  // [m/s]
  float slowest_slip;     // [m/s]
  Vec4 gravity;
  Vec4 wind;       // [m/s]
  float air_drag;  // density of the air * coefficient / 4 [kg/m^3]
  float air_lift;
  std::vector<FloatCollider> colliders;
  bool has_bodies;  // among the colliders
  BodyNumbers bodies;
  std::shared_ptr<const ElasticEntries> elastic_entries;  // null without lines
  // Null without a grid's apply_elastic.
  std::shared_ptr<const GridStrengths> grid_strengths;
  std::vector<FloatHingeStage> hinge_stages;  // SolverChoice::hinge_stages
  float max_elastic_frequency_sq;             // [1/s^2]
  float span_give;                            // SolverChoice::span_give
  float end_share;  // of the direction at the end of the substep in that of an impulse, [0, 1]
};

}  // namespace drape::cpu
