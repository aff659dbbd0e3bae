// The parameters of one cloth in single precision, with everything that follows from them once.
#pragma once

#include <vector>

#include "server/solver/cloth_parameters.h"
#include "server/solver/cpu/constraint_math.h"
#include "server/solver/cpu/float_model.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

struct FloatCollider {
  bool is_sphere;
  Lanes point;   // centre of a sphere, point of a plane
  Lanes normal;  // of a plane
  float offset;  // what is taken off the distance: radius of a sphere, and the cloth's thickness

  Gap GapAt(Lanes q) const {
    return is_sphere ? SphereGap(q, point, offset) : PlaneGap(q, point, normal, offset);
  }
};

// A function of the cloth's model and parameters alone.
struct FloatControls {
  FloatControls(const FloatModel& model, const ClothParameters& parameters);

  uint32_t substeps;
  uint32_t max_iterations;
  float h;                       // substep [s]
  float inverse_h;               // [1/s]
  float tolerance;               // relative to the rest length; 0 = fixed number of sweeps
  float contact_tolerance;       // [m]
  float depenetration_distance;  // [m] per substep
  float damping_factor;          // of the velocity per substep, 1 = none
  float friction_static;
  float friction_dynamic;
  Lanes gravity;
  std::vector<FloatCollider> colliders;
  bool use_tethers;
  bool has_half_kicks;     // springs by half kicks
  bool has_spring_forces;  // springs in the force of the substep
  StepWarnings warnings;   // those that are known before the step
};

}  // namespace drape::cpu
