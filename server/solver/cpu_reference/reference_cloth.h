// A cloth as the reference backend keeps it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/backend.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/step_report.h"
#include "server/solver/surface_contact/surface_parts.h"

namespace drape {

// A cloth between two steps.
struct ReferenceCloth {
  std::shared_ptr<const SceneModel> model;
  ClothParameters parameters;
  ParticleState state;
  std::vector<Eigen::Vector3d> pin_targets_m;  // [pin_count]
  FaultReason fault = FaultReason::kNone;
  std::vector<Grip> grips{};  // of the step under way
  // Rest lengths of its own, before the step and at its end; [constraint_count], or empty: those of
  // the model.
  std::vector<double> rest_lengths_m{};
  std::vector<double> rest_length_targets_m{};

  std::shared_ptr<const ContactSurface> contact_surface{};  // if it touches itself
  std::shared_ptr<const ContactSurface> world_surface{};    // of its model, if it is in a world
  std::shared_ptr<const SurfaceParts> surface_parts{};      // if these touch colliders
  bool may_cross_itself = true;  // or another cloth; until a step has found that nothing crosses

  bool has_own_lengths() const { return !rest_lengths_m.empty(); }
};

}  // namespace drape
