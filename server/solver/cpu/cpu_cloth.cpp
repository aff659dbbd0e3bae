#include "server/solver/cpu/cpu_cloth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/solver/collider_contact.h"
#include "server/solver/cpu/alone/self_contacts.h"
#include "server/solver/cpu/long_step.h"
#include "server/solver/cpu/side_by_side/group_step.h"

namespace drape::cpu {
namespace {

// A step begins with the lengths at which the last one ended; without targets it keeps them.
void SetLengthTargets(Cloth& cloth, std::span<const double> rest_lengths_m) {
  if (cloth.own_lengths) cloth.own_lengths->starts = cloth.own_lengths->targets;
  if (rest_lengths_m.empty()) return;
  DRAPE_CHECK(cloth.own_lengths.has_value(), "only a cloth with rest lengths of its own is driven");
  cloth.own_lengths->targets = PackLengths(*cloth.model, rest_lengths_m);
}

void CheckMotionCount(const ClothParameters& parameters) {
  const size_t count = parameters.collider_motions.size();
  DRAPE_CHECK(count == 0 || count == parameters.colliders.size(), "one motion per collider");
}

// Of a cloth that touches itself: whether a step in lanes, without contacts, is worth a try.
bool MayBeApart(const Cloth& cloth) {
  return cloth.was_apart && !cloth.may_cross_itself &&
         cloth.scheme->controls.plan.solver.has_two_steps;
}

// Empty: they go on.
void SetColliderMotions(Cloth& cloth, std::span<const RigidMotion> motions) {
  if (motions.empty()) return;
  DRAPE_CHECK(HasMovingColliders(cloth.parameters),
              "only a cloth with moving colliders has motions");
  cloth.parameters.collider_motions.assign(motions.begin(), motions.end());
  CheckMotionCount(cloth.parameters);
}

double FastestSpeed(const FloatState& state) {
  float fastest_sq = 0;
  for (const Vec4& v : state.velocities) fastest_sq = std::max(fastest_sq, Dot(v, v));
  return std::sqrt(fastest_sq);
}

// In the step that it is about to do.
EdgesOfStep EdgesOf(const Cloth& cloth, const HeldParticles& held) {
  const StepSettings& settings = cloth.parameters.settings;
  EdgesOfStep edges{settings.collider_contact, cloth.model->source->length_scale_m()};
  if (edges.contact != ColliderContact::kAuto) return edges;
  edges.way_m = WayInSubstep_m(FastestSpeed(cloth.state), cloth.parameters.gravity_m_per_s2.norm(),
                               settings.time_step_s, settings.substeps);
  edges.substep_s = settings.substep_s();
  for (size_t k = 0; k < held.particles.size() && !edges.is_pulled; ++k) {
    edges.is_pulled = Pulls(ToVector3d(cloth.state.positions[held.particles[k]]),
                            ToVector3d(held.targets[k]), settings.time_step_s);
  }
  return edges;
}

}  // namespace

FloatState ToFloat(const ParticleState& state, uint32_t particle_count) {
  DRAPE_CHECK(state.positions_m.size() == particle_count &&
                  state.velocities_m_per_s.size() == particle_count,
              "the state does not fit the model");
  FloatState result;
  for (const auto& p : state.positions_m) result.positions.push_back(ToVec4(p));
  for (const auto& v : state.velocities_m_per_s) result.velocities.push_back(ToVec4(v));
  result.positions.push_back(Vec4{});
  result.velocities.push_back(Vec4{});
  return result;
}

std::vector<Vec4> ToFloat(std::span<const Eigen::Vector3d> targets, const FloatModel& model) {
  DRAPE_CHECK(targets.size() == model.pins.size(), "one target per pin is needed");
  std::vector<Vec4> result;
  for (const auto& target : targets) result.push_back(ToVec4(target));
  return result;
}

std::vector<Vec4> TransferTargets(const Cloth& cloth, const FloatState& state,
                                  const FloatModel& new_model) {
  std::vector<Vec4> targets;
  const std::vector<uint32_t>& old_pins = cloth.model->pins;
  for (const uint32_t particle : new_model.pins) {
    const auto found = std::lower_bound(old_pins.begin(), old_pins.end(), particle);
    const bool was_pin = found != old_pins.end() && *found == particle;
    targets.push_back(was_pin ? cloth.pin_targets[static_cast<size_t>(found - old_pins.begin())]
                              : state.positions[particle]);
  }
  return targets;
}

void Append(const std::vector<Vec4>& values, uint32_t particle_count,
            std::span<const uint32_t> particles, std::vector<float>& packed) {
  const size_t words = 3 * size_t{RowsOf(particles, particle_count)};
  packed.resize(packed.size() + words);
  float* to = packed.data() + packed.size() - words;
  const auto append = [&](const Vec4& value) {
    to[0] = value[0];
    to[1] = value[1];
    to[2] = value[2];
    to += 3;
  };
  if (particles.empty()) std::for_each_n(values.begin(), particle_count, append);
  for (const uint32_t particle : particles) append(values[particle]);
}

Scheme::Scheme(const FloatModel& model, const ClothParameters& parameters, bool has_own_lengths)
    : controls(model, parameters, has_own_lengths) {
  if (!controls.energy_limit.is_watched || !HasCalmerScheme(controls.plan)) return;
  calmer_controls.emplace(model, WithCalmerScheme(parameters), has_own_lengths);
}

void SetScheme(Cloth& cloth) {
  cloth.scheme =
      std::make_shared<const Scheme>(*cloth.model, cloth.parameters, cloth.own_lengths.has_value());
}

void SetSurfaces(Cloth& cloth, PartsOfModels& made, Interruption* interruption) {
  const FloatControls& controls = cloth.scheme->controls;
  const std::shared_ptr<const SceneModel>& model = cloth.model->source;
  const bool has_parts = controls.plan.solver.has_surface_contacts;
  cloth.surface_parts = has_parts ? made.parts.Get(model, interruption) : nullptr;
  std::shared_ptr<const ContactSurface> surface;
  const bool may_meet = cloth.parameters.is_in_world && !model->triangles().empty();
  if (controls.touches_itself || may_meet) surface = made.surfaces.Get(model, interruption);
  cloth.contact_surface = controls.touches_itself ? surface : nullptr;
  cloth.kept_surface = std::move(surface);
}

std::shared_ptr<const void> PartsOfModels::ForCloth(const std::shared_ptr<const SceneModel>& model,
                                                    const ClothParameters& parameters,
                                                    Interruption* interruption) {
  Cloth cloth;
  cloth.model = models.Get(model);
  Ask(interruption);
  cloth.parameters = parameters;
  SetScheme(cloth);
  SetSurfaces(cloth, *this, interruption);
  using Parts = std::array<std::shared_ptr<const void>, 3>;
  return std::make_shared<const Parts>(
      Parts{cloth.model, std::move(cloth.kept_surface), std::move(cloth.surface_parts)});
}

void EndSelfContacts(Cloth& cloth, const StepReport& report, const StepScratch& scratch) {
  cloth.may_cross_itself = report.warnings.starts_crossing || scratch.self_contacts_failed;
  cloth.was_apart = cloth.contact_surface != nullptr && FoundNoContacts(scratch);
}

std::optional<OwnLengths> ToOwnLengths(std::span<const double> rest_lengths_m,
                                       const FloatModel& model) {
  if (rest_lengths_m.empty()) return std::nullopt;
  DRAPE_CHECK(rest_lengths_m.size() == model.constraint_places.size(),
              "one rest length per constraint");
  std::vector<Vec4> packed = PackLengths(model, rest_lengths_m);
  return OwnLengths{packed, packed};
}

void Abandon(Cloth& cloth) {
  if (cloth.long_step == nullptr) return;
  const std::shared_ptr<LongStep> step = cloth.long_step;
  for (Cloth* const each : step->cloths()) {
    each->long_step = nullptr;
    if (each->fault == FaultReason::kNone) DropTargets(*each);
  }
}

void DropTargets(Cloth& cloth) {
  if (cloth.own_lengths) cloth.own_lengths->targets = cloth.own_lengths->starts;
}

void SetTargets(Cloth& cloth, const StepItem& item) {
  Abandon(cloth);
  if (!item.pin_targets_m.empty()) cloth.pin_targets = ToFloat(item.pin_targets_m, *cloth.model);
  SetLengthTargets(cloth, item.rest_lengths_m);
  SetColliderMotions(cloth, item.collider_motions);
}

StepContext ContextOf(Cloth& cloth, const StepItem& item, const Scheme& scheme,
                      bool leaves_out_colliders, StepTeam& team, StepScratch& scratch) {
  DRAPE_CHECK(item.grips.size() <= cloth.parameters.max_grips, "no more grips than max_grips");
  StepContext context{*cloth.model,
                      scheme.controls,
                      cloth.grips.Hold(*cloth.model, cloth.pin_targets, item.grips),
                      cloth.own_lengths ? &*cloth.own_lengths : nullptr,
                      cloth.parameters.collider_motions,
                      scratch,
                      team,
                      IterationsOf(item, cloth.parameters.settings),
                      leaves_out_colliders,
                      scheme.calmer_controls ? &*scheme.calmer_controls : nullptr};
  context.contact_surface = cloth.contact_surface.get();
  context.surface_parts = cloth.surface_parts.get();
  context.may_cross_itself = cloth.may_cross_itself;
  context.asks_for_impulses = item.impulses;
  context.asks_for_contacts = item.impulses && item.contact_impulses;
  context.colliders = cloth.parameters.colliders;
  context.energy = item.energy;
  if (context.surface_parts != nullptr) context.edges = EdgesOf(cloth, context.held);
  return context;
}

void EndStep(Cloth& cloth, const StepReport& report) {
  cloth.fault = report.fault;
  if (cloth.fault != FaultReason::kNone) return;
  for (RigidMotion& motion : cloth.parameters.collider_motions) {
    motion = motion.After(cloth.parameters.settings.time_step_s);
  }
  if (report.bodies == nullptr) return;
  for (const BodyState& body : *report.bodies) {
    cloth.parameters.collider_motions[body.collider] = body.motion;
  }
}

bool ClothFitsLanes(const Cloth& cloth) {
  return cloth.fault == FaultReason::kNone && !cloth.own_lengths &&
         FitsLanes(*cloth.model, cloth.scheme->controls) &&
         (cloth.contact_surface == nullptr || MayBeApart(cloth));
}

}  // namespace drape::cpu
