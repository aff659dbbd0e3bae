#include <algorithm>
#include <cmath>

#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

namespace {

// The part of an error that an impulse may still remove: of an inequality no more than undoes the
// impulses so far.
double RemovableError(const StepContext& context, uint32_t index, double error) {
  const auto& constraint = context.model.constraints()[index];
  const double error_per_impulse = context.h * (context.w[constraint.i] + context.w[constraint.j]) +
                                   constraint.compliance_m_per_n / context.h;
  if (constraint.kind == ConstraintKind::kEqual) return error;
  return error_per_impulse *
         ClampImpulse(constraint.kind, context.lambda[index], -error / error_per_impulse);
}

}  // namespace

double Residual(const StepContext& context) {
  const SceneModel& model = context.model;
  double residual = 0;
  for (uint32_t index = 0; index < model.constraint_count(); ++index) {
    const auto& constraint = model.constraints()[index];
    if (context.IsHeld(constraint.i, constraint.j)) continue;
    const double length = context.PredictedDifference(constraint.i, constraint.j).norm();
    const double error = DistanceError(context, index, length);
    residual = std::max(residual, std::abs(RemovableError(context, index, error)));
  }
  for (uint32_t index = 0; index < model.joint_count(); ++index) {
    const PointJoint& joint = model.joints()[index];
    if (context.IsHeld(joint.i, joint.j)) continue;
    residual = std::max(residual, JointError(context, index).norm());
  }
  SeldomInterruption interruption(context.interruption);
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    if (context.w[i] == 0) continue;
    for (size_t c = 0; c < context.colliders.size(); ++c) {
      interruption.Check();
      residual =
          std::max(residual, ContactFloor(context, i, c) - PredictedContact(context, i, c).gap);
    }
  }
  return std::max(residual, context.surface_contacts.LargestError(context));
}

}  // namespace drape::reference
