// A cloth of the backend `cpu`: its data, and how a step begins and ends for it. The owner sees to
// it that nobody else touches a cloth meanwhile.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/solver/backend.h"
#include "server/solver/cpu/alone/cloth_step.h"
#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/model/held_particles.h"
#include "server/solver/cpu/model/own_lengths.h"

namespace drape::cpu {

// A step that is done in pieces, with working memory of its own.
struct LongStep {
  StepScratch scratch;
  StepProgress progress;
};

// A cloth of the backend.
struct Cloth {
  std::shared_ptr<const FloatModel> model;
  ClothParameters parameters;
  std::optional<FloatControls> controls;  // always set in a used slot
  FloatState state;
  std::vector<Vec4> pin_targets;  // [pin_count]
  std::optional<OwnLengths> own_lengths{};
  Grips grips{};
  FaultReason fault = FaultReason::kNone;
  std::shared_ptr<LongStep> long_step{};           // null: none has begun
  std::optional<FloatControls> calmer_controls{};  // of a watched cloth that has a calmer scheme
  // Only of cloths that touch themselves.
  std::shared_ptr<const ContactSurface> contact_surface{};
  bool may_cross_itself = true;  // until a step has found that nothing crosses
};

FloatState ToFloat(const ParticleState& state, uint32_t particle_count);
std::vector<Vec4> ToFloat(std::span<const Eigen::Vector3d> targets, const FloatModel& model);

// Pins that stay pins keep their targets; new ones start where their particles are.
std::vector<Vec4> TransferTargets(const Cloth& cloth, const FloatModel& new_model);

// From its model, parameters and lengths.
void SetControls(Cloth& cloth);

void EndSelfContacts(Cloth& cloth, const StepReport& report, const StepScratch& scratch);

// Empty: none.
std::optional<OwnLengths> ToOwnLengths(std::span<const double> rest_lengths_m,
                                       const FloatModel& model);

// Drops a step that was done in pieces.
void Abandon(Cloth& cloth);

// Sets the targets of pins, lengths and colliders in a step that begins.
void SetTargets(Cloth& cloth, const StepItem& item);
void EndStep(Cloth& cloth, const StepReport& report);

// Whether the cloth can be stepped in lanes (group_step.h).
bool ClothFitsLanes(const Cloth& cloth);

}  // namespace drape::cpu
