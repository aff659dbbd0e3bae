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
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/surface_contact/surface_parts.h"

namespace drape::cpu {

class LongStep;
struct World;

// How a cloth is stepped, as follows from its model, parameters and lengths.
struct Scheme {
  Scheme(const FloatModel& model, const ClothParameters& parameters, bool has_own_lengths);

  FloatControls controls;
  std::optional<FloatControls> calmer_controls;  // of a watched cloth that has a calmer scheme
};

// What cloths of the same model share. Thread-safe.
struct PartsOfModels {
  // All that a cloth with these parameters takes from here, as long as the result is held; but for
  // it, small.
  std::shared_ptr<const void> ForCloth(const std::shared_ptr<const SceneModel>& model,
                                       const ClothParameters& parameters,
                                       Interruption* interruption = nullptr);

  FloatModelCache models{};
  ContactSurfaceCache surfaces{};
  SurfacePartsCache parts{};
};

// A cloth of the backend.
struct Cloth {
  std::shared_ptr<const FloatModel> model;
  ClothParameters parameters;
  std::shared_ptr<const Scheme> scheme{};  // always set in a used slot
  FloatState state;
  std::vector<Vec4> pin_targets;  // [pin_count]
  std::optional<OwnLengths> own_lengths{};
  Grips grips{};
  FaultReason fault = FaultReason::kNone;
  std::shared_ptr<LongStep> long_step{};  // of each that takes part; null: none has begun
  std::shared_ptr<const ContactSurface> contact_surface{};  // if it touches itself
  std::shared_ptr<const SurfaceParts> surface_parts{};      // if these touch colliders
  // Also where a world may need it in a step: it takes long to make.
  std::shared_ptr<const void> kept_surface{};
  bool may_cross_itself = true;  // or another cloth; until a step has found that nothing crosses
  // Its last step found that nothing of it could touch: the next one may do so in lanes. The result
  // does not depend on it.
  bool was_apart = false;
  std::shared_ptr<const World> world{};  // of the first cloth of a world, to step it again
};

FloatState ToFloat(const ParticleState& state, uint32_t particle_count);
std::vector<Vec4> ToFloat(std::span<const Eigen::Vector3d> targets, const FloatModel& model);

// The targets of the pins of `new_model`: those of pins that stay, else where `state` is.
std::vector<Vec4> TransferTargets(const Cloth& cloth, const FloatState& state,
                                  const FloatModel& new_model);

// Appends x, y and z of those of `particles`; empty: of all.
void Append(const std::vector<Vec4>& values, uint32_t particle_count,
            std::span<const uint32_t> particles, std::vector<float>& packed);

// Sets its scheme. Another object each time.
void SetScheme(Cloth& cloth);
// After its scheme: what of it touches itself, and colliders.
void SetSurfaces(Cloth& cloth, PartsOfModels& made, Interruption* interruption = nullptr);

// Empty: none.
std::optional<OwnLengths> ToOwnLengths(std::span<const double> rest_lengths_m,
                                       const FloatModel& model);

// Drops a step that was done in pieces, for all that take part.
void Abandon(Cloth& cloth);
// Lengths are what they were when a step began that is dropped.
void DropTargets(Cloth& cloth);

// Sets the targets of pins, lengths and colliders in a step that begins.
void SetTargets(Cloth& cloth, const StepItem& item);
// What a step of the cloth works on, after SetTargets; valid as long as the cloth is not changed.
StepContext ContextOf(Cloth& cloth, const StepItem& item, const Scheme& scheme,
                      bool leaves_out_colliders, StepTeam& team, StepScratch& scratch);
void EndStep(Cloth& cloth, const StepReport& report);
// Beside it, of a cloth that was not stepped in lanes; `scratch`: of its step.
void EndSelfContacts(Cloth& cloth, const StepReport& report, const StepScratch& scratch);

// Whether the cloth can be stepped in lanes (group_step.h).
bool ClothFitsLanes(const Cloth& cloth);

}  // namespace drape::cpu
