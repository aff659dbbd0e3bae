// What a substep does to each particle by itself: predict, integrate; and with tethers all of it in
// one visit.
#pragma once

#include <optional>

#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {

// The velocities of the free particles become u, with two steps their positions b. Needs the
// accelerations if springs are in the force.
void PredictFree(const StepContext& context);
void PredictPins(const StepContext& context);

// The end of the substep: of all particles, of the pins alone.
void Integrate(const StepContext& context);
void IntegratePins(const StepContext& context);

// Whether nothing but constraints, gravity and damping acts, and no collider is near: then all that
// happens to a particle between two sweeps is a matter of its own and its pins. Needs the reach.
bool HasOneVisit(const StepContext& context);

// What ends such a substep for a free particle.
class Ending {
 public:
  explicit Ending(const StepContext& context);
  // Position and velocity of a particle.
  void operator()(Lanes& p, Lanes& v) const {
    p += interval_ * v;
    v = is_two_step_ ? v : (v + kick_) * damping_factor_;
  }

 private:
  const bool is_two_step_;
  const float interval_;
  const float damping_factor_;
  const Lanes kick_;
};

// What is left of the substep before (`open`), then predict and, if asked for, tether, of the free
// particles; the pins have been predicted.
void PrepareInOneVisit(const StepContext& context, const std::optional<Ending>& open,
                       bool has_tethers);
void End(const StepContext& context, const Ending& open);

}  // namespace drape::cpu
