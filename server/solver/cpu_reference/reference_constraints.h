// Inequality constraints, point joints and rest lengths that change
// (server/solver/method.md, solve_distance and solve_joints).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// The part of `impulse` [N s] that leaves the accumulated impulse `lambda` with the sign of the
// kind: a rope only pulls (lambda <= 0), a strut only pushes (lambda >= 0).
double ClampImpulse(ConstraintKind kind, double lambda, double impulse);

// The part of the error [m] that the kind does not allow: none of a slack rope.
double Violation(ConstraintKind kind, double error_m);

// Rest lengths of one cloth during a step, [constraint_count]: those of the model, or between what
// they were and what they will be at the end of the step.
class ReferenceLengths {
 public:
  // Both spans empty, or [constraint_count] each; they outlive this.
  ReferenceLengths(const SceneModel& model, std::span<const double> starts_m,
                   std::span<const double> targets_m)
      : model_(model), starts_m_(starts_m), targets_m_(targets_m) {}

  // For the substep `substep` of `substeps`: the lengths at its end.
  void Advance(uint32_t substep, uint32_t substeps);
  double operator[](uint32_t index) const {
    return lengths_m_.empty() ? model_.constraints()[index].rest_length_m : lengths_m_[index];
  }

 private:
  const SceneModel& model_;
  const std::span<const double> starts_m_;
  const std::span<const double> targets_m_;
  std::vector<double> lengths_m_;  // empty: the model's
};

}  // namespace drape
