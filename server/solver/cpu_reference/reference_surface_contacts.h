// The contacts of the insides of edges and triangles with colliders (surface_contact/), in double
// precision.
#pragma once

#include <vector>

#include "server/solver/surface_contact/surface_contacts.h"

namespace drape::reference {

struct StepContext;
using SurfaceVector = self_contact::Vector3d;

// Those of one step.
class ReferenceSurfaceContacts {
 public:
  // Before the first substep. `parts`: null: particles alone touch.
  void Begin(const StepContext& context, const SurfaceParts* parts);

  // The parts of a substep: before the prediction, in a sweep, after the integration and with
  // correct_velocity.
  void Find(const StepContext& context);
  bool Solve(StepContext& context);
  void Advance(const StepContext& context);
  void Correct(StepContext& context);

  bool has_given_up() const { return has_any_ && contacts_.has_given_up(); }
  // Largest error left after the sweeps [m].
  double LargestError(const StepContext& context) const;

 private:
  // To the colliders and to what is held.
  void PassOn(const StepContext& context) const;

  bool has_any_ = false;
  std::vector<double> inverse_masses_;
  surface_contact::SurfaceContacts<SurfaceVector> contacts_;
};

}  // namespace drape::reference
