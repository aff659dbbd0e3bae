// The parameters of one cloth in single precision, with everything that follows from them once.
#pragma once

#include <array>
#include <vector>

#include "server/solver/cloth_parameters.h"
#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/cpu/formulas/distance_map_gap.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/step_plan.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

struct FloatCollider {
  enum class Kind { kSphere, kPlane, kCapsule, kBox, kDistanceMap };

  Kind kind;
  // Centre of a sphere or box, point of a plane, end a of a capsule, corner of a distance map.
  Vec4 point;
  Vec4 vector;   // normal of a plane, end b - end a of a capsule, half extents of a box
  float offset;  // what is taken off the distance: radius, if any, and the cloth's thickness
  // The axes of a box or distance map. A capsule has only [0], the normal on its segment.
  std::array<Vec4, 3> axes{};
  DistanceSamples samples{};  // of a distance map
};

// Limits of a link's squared length, relative to the square of its rest length.
struct RefineLimits {
  explicit RefineLimits(double strain)
      : min_sq(static_cast<float>((1 - strain) * (1 - strain))),
        max_sq(static_cast<float>((1 + strain) * (1 + strain))) {}

  float min_sq;
  float max_sq;
};

// A function of the cloth's model and parameters alone.
struct FloatControls {
  FloatControls(const FloatModel& model, const ClothParameters& parameters, bool has_own_lengths);

  // Whether the stage has anything to do.
  bool Has(StepStage stage) const { return plan.Has(stage); }
  bool has_start_directions() const { return end_share < 1; }

  StepPlan plan;
  double damping_per_s;
  float time_step;               // [s]
  float h;                       // substep [s]
  float inverse_h;               // [1/s]
  float tolerance;               // relative to the rest length; 0 = fixed number of sweeps
  RefineLimits refine_limits;    // within them a link is not refined
  float contact_tolerance;       // [m]
  float depenetration_distance;  // [m] per substep
  float friction_static;
  float friction_dynamic;
  bool has_restitution;
  float restitution;
  float slowest_rebound;  // [m/s]
  Vec4 gravity;
  Vec4 wind;       // [m/s]
  float air_drag;  // density of the air * coefficient / 4 [kg/m^3]
  float air_lift;
  std::vector<FloatCollider> colliders;
  float end_share;  // of the direction at the end of the substep in that of an impulse, [0, 1]
};

}  // namespace drape::cpu
