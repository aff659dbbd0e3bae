// The contacts of cloths with themselves and with those of their world (self_contact/), in double
// precision.
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/self_contact/self_contacts.h"
#include "server/solver/step_report.h"

namespace drape::reference {

struct StepContext;
// Of one cloth, or of all of a world in its order.
using StepContexts = std::deque<StepContext>;
using SelfVector = self_contact::Vector3d;

// Those of one step. `contexts` are the same in each call.
class ReferenceSelfContacts {
 public:
  // Before the first substep. `surface`: of the cloth or the world; null: nothing touches.
  // `interruption`: of the whole step; null: nobody is asked.
  void Begin(StepContexts& contexts, const ContactSurface* surface, bool may_cross,
             Interruption* interruption);
  // Whether parts of cloth `index` crossed something then.
  bool StartsCrossing(const StepContexts& contexts, size_t index) const;
  // Pins forced something through something.
  bool has_failed() const { return has_failed_; }
  // As of SelfContacts.
  bool has_given_up() const { return surface_ != nullptr && contacts_.has_given_up(); }

  // The stages of a substep.
  void Find(StepContexts& contexts);
  bool Solve(StepContexts& contexts);
  // Sweeps of the substep: max_iterations, or more if the last one ended with a hard hit.
  uint32_t SweepsAfterHits(const StepContexts& contexts) const;
  void Guard(StepContexts& contexts);

 private:
  void TakePulls(const StepContexts& contexts);
  // What contacts have changed the velocities of free particles by: those of the substep, and those
  // before it. Gathered as by Gather.
  void TellChanges(const StepContexts& contexts, const std::vector<SelfVector>& before,
                   const std::vector<SelfVector>& after, bool in_memory) const;

  const ContactSurface* surface_ = nullptr;
  self_contact::SelfContacts<SelfVector> contacts_;
  std::vector<double> thicknesses_, inverse_masses_;
  std::vector<self_contact::FrictionNumbers<double>> frictions_;
  std::vector<SelfVector> starts_;  // positions at the start of the substep
  // With StepContext::impulses, of a substep: self_contact::HeldPulls.
  std::vector<SelfVector> pulls_, pulls_in_memory_;
  bool has_failed_ = false;
};

// One of the cloths that a report tells of.
struct MeasuredCloth {
  const ClothParameters* parameters;
  const ParticleState* state;
  Eigen::Vector3d origin_m;  // of its frame in that of its world
};

// What reports say of the contacts of one cloth, or of all of a world.
std::vector<self_contact::SelfContactMeasures> MeasureSelfContacts(
    const ContactSurface& surface, std::span<const MeasuredCloth> cloths,
    Interruption* interruption);

}  // namespace drape::reference
