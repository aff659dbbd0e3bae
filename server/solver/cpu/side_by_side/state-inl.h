// The data that a step of a group of cloths works on. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_STATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_STATE_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_STATE_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_STATE_INL_H_
#endif

#include <algorithm>
#include <array>
#include <span>

#include "server/solver/cpu/side_by_side/group.h"
#include "server/solver/cpu/side_by_side/impulses-inl.h"
#include "server/solver/cpu/simd/vec_cloths-inl.h"
#include "server/solver/cpu/step/lane_contacts-inl.h"
#include "server/solver/cpu/step/strip_solve-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// One particle of each cloth. While a substep lasts p is b and u the mean velocity, else v.
struct ClothParticle {
  VectorsCloths p, u;
};

// What rounding took from its position, of b within a substep, and the same one substep before [m].
struct ClothRemainders {
  VectorsCloths now, previous;
};

// ExpectedFlight of each cloth.
struct ClothFlight {
  ClothParticle* expected = nullptr;  // null: nobody asks; p at the start of the step, velocity
  VecCloths drift = SplatCloths(0);
  float substep_s = 0;
  float since_start = 0;                                  // at the start of the substep [s]
  float time = 0;                                         // at its end
  ClothBox drifts{};                                      // of the particles that have ended it
  MaskCloths is_kept = SplatCloths(0) >= SplatCloths(0);  // in all substeps that have ended
};

using PairLinkSolution = StripLinkSolution<VecPair, VectorsPair>;

// Stages of free particles that are due but not done, in their order: each changes a particle by
// itself alone. They are settled in one visit per particle when a stage reads particles
// (advance-inl.h).
struct OpenStages {
  bool integrate = false;
  bool damp = false;
  bool predict = false;
  bool tether = false;
  // The substep that `integrate` and `damp` end; the others belong to the one under way.
  FloatSubstep ended{};
  VecCloths damping_factor = SplatCloths(1);

  bool any() const { return integrate || damp || predict || tether; }
};

// One number of each cloth; lanes without a cloth are like the last one.
template <class Number>
VecCloths NumberOf(std::span<const GroupCloth> cloths, const Number& number) {
  alignas(64) float values[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    values[lane] = number(cloths[std::min(lane, cloths.size() - 1)].context.controls);
  }
  return LoadCloths(values);
}

template <class Vector>
VectorsCloths VectorOf(std::span<const GroupCloth> cloths, const Vector& vector) {
  return {NumberOf(cloths, [&](const FloatControls& c) { return vector(c)[0]; }),
          NumberOf(cloths, [&](const FloatControls& c) { return vector(c)[1]; }),
          NumberOf(cloths, [&](const FloatControls& c) { return vector(c)[2]; })};
}

// The numbers of an elastic element, of each cloth.
struct OwnElement {
  VecCloths mass, frequency_sq;
  VecCloths stiffness, damping;  // ElementStrength, of a grid
};

// A number of two lines of elastic elements: the same of all cloths, or `own` of each.
struct OwnNumbers {
  NumberPair same;
  const VecPair* own = nullptr;  // null: the same
};
using OwnPlace = ElasticPlace<std::array<uint32_t, 2>, OwnNumbers>;

// What differs between cloths that hold different particles.
struct OwnPins {
  const PinLists* lists = nullptr;      // null: the cloths hold the same
  VecCloths* inverse_masses = nullptr;  // [particle_count + 1]
  ClothParticle* pins = nullptr;        // [PinLists::pin_count]
  // Of each elastic element its place in `elements`; 0: all cloths have the numbers of the first.
  const uint32_t* element_places = nullptr;
  OwnElement* elements = nullptr;
  const OwnPlace* elastic_places = nullptr;  // as ElasticEntries::pairs.places
  VecPair* spans = nullptr;                  // [strip_pairs] 1: a span (FindSpans); else 0
};

OwnPins OwnPinsOf(std::span<const GroupCloth> cloths, GroupScratch& scratch) {
  if (HoldTheSame(cloths)) return {};
  const PinLists& lists = scratch.pin_lists;
  return {&lists,
          scratch.inverse_masses.Reserve<VecCloths>(lists.held_by.size() + 1),
          scratch.pins.Reserve<ClothParticle>(lists.pin_count),
          nullptr,
          nullptr,
          nullptr,
          scratch.spans.Reserve<VecPair>(cloths[0].context.model.layout().strip_pairs.size())};
}

// One bit each; lanes without a cloth are like the last one.
uint32_t WithRemainders(std::span<const GroupCloth> cloths) {
  uint32_t lanes = 0;
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const size_t k = std::min(lane, cloths.size() - 1);
    const bool has = k == lane
                         ? HasRemainders(cloths[k].context.controls.plan.solver, cloths[k].state)
                         : (lanes >> k & 1) != 0;
    lanes |= static_cast<uint32_t>(has) << lane;
  }
  return lanes;
}

// Everything one step of a group needs.
struct GroupContext {
  // scratch.pin_lists are made.
  GroupContext(std::span<const GroupCloth> cloths, GroupScratch& scratch)
      : own_pins(OwnPinsOf(cloths, scratch)),
        model(has_own_pins() ? cloths[0].context.model.layout() : cloths[0].context.model),
        elastic_groups(cloths[0].context.model.elastic_groups),
        free_particles(has_own_pins() ? own_pins.lists->free_particles : model.free_particles),
        controls(cloths[0].context.controls),
        max_iterations(cloths[0].context.max_iterations),
        particles(scratch.particles.Reserve<ClothParticle>(particle_count())),
        previous(scratch.previous.Reserve<ClothParticle>(
            controls.plan.schedule.has_two_steps() ? particle_count() : 0)),
        cloths_with_remainders(WithRemainders(cloths)),
        remainders(scratch.remainders.Reserve<ClothRemainders>(
            cloths_with_remainders != 0 ? particle_count() : 0)),
        pin_targets(scratch.pin_targets.Reserve<VectorsCloths>(pin_count())),
        path_solution(scratch.path_solution.Reserve<PairLinkSolution>(
            std::max(model.longest_strip, model.longest_elastic_line))),
        end_directions(scratch.end_directions.Reserve<VectorsPair>(
            controls.has_start_directions() ? model.longest_strip : 0)),
        distance_impulses(scratch.distance_impulses.Reserve<VecCloths>(impulse_count())),
        twists(
            scratch.twists.Reserve<VectorsCloths>(2 * (model.source->grid_columns() + size_t{1}))),
        reach(scratch.reaches[0]),
        colliders(scratch.colliders.Reserve<ClothCollider>(collider_count())),
        motions(cloths[0].context.collider_motions.empty()
                    ? nullptr
                    : scratch.motions.Reserve<ClothMotion>(collider_count())),
        accelerations(scratch.accelerations.Reserve<VectorsCloths>(
            model.has_springs() ? model.particle_count : 0)),
        impulses(scratch.impulses.Reserve<VectorsCloths>(kick_count())),
        predicted(scratch.predicted.Reserve<VectorsCloths>(
            controls.plan.solver.has_two_steps || has_hinge_stages() ? particle_count() : 0)),
        hinge_changes(scratch.hinge_changes.Reserve<VectorsCloths>(
            has_hinge_stages() ? model.particle_count : 0)),
        joint_impulses(scratch.joint_impulses.Reserve<VectorsCloths>(model.joints.size())),
        refinement(scratch.refinement),
        mixed_links(scratch.mixed_links),
        contacts(scratch.contacts.Reserve<ClothContact>(model.particle_count * collider_count())),
        quiet_round_offs(scratch.quiet_round_offs.Reserve<VecCloths>(
            controls.plan.solver.has_quiet_links ? particle_count() : 0)),
        gravity(VectorOf(cloths, [](const FloatControls& c) { return c.gravity; })),
        wind(VectorOf(cloths, [](const FloatControls& c) { return c.wind; })),
        air_drag(NumberOf(cloths, [](const FloatControls& c) { return c.air_drag; })),
        air_lift(NumberOf(cloths, [](const FloatControls& c) { return c.air_lift; })),
        end_share(NumberOf(cloths, [](const FloatControls& c) { return c.end_share; })),
        span_give(NumberOf(cloths, [](const FloatControls& c) { return c.span_give; })),
        contact_cloths(gravity, [&](auto member) {
          return NumberOf(cloths, [&](const FloatControls& c) { return c.*member; });
        }) {}

  bool has_own_pins() const { return own_pins.lists != nullptr; }
  size_t pin_count() const {
    return has_own_pins() ? own_pins.lists->pin_count : model.pins.size();
  }
  // Whether some cloth moves particle i freely.
  HWY_INLINE bool IsFree(uint32_t i) const {
    return has_own_pins() ? i < model.particle_count && HeldBy(i) != own_pins.lists->all_cloths
                          : model.IsFree(i);
  }
  // With own pins: whether some cloth holds particle i.
  bool IsHeldBySome(uint32_t i) const { return has_own_pins() && HeldBy(i) != 0; }
  // Set for the cloths that do not hold it.
  MaskCloths FreeCloths(uint32_t i) const { return MaskOf(~HeldBy(i)); }
  VecCloths InverseMass(uint32_t i) const {
    return has_own_pins() ? own_pins.inverse_masses[i] : SplatCloths(model.inverse_masses[i]);
  }
  // Colliders that the step works on.
  size_t collider_count() const { return reach.near.size(); }
  // With the spare one.
  size_t particle_count() const { return model.particle_count + size_t{1}; }
  // Whether the strips solve a link more than once in a substep: then they need what they have
  // accumulated.
  bool SolvesLinksAgain() const { return max_iterations > 1 || model.has_ways_back(); }
  // Whether they or a report read it.
  bool KeepsImpulses() const { return SolvesLinksAgain() || substep.is_last; }
  // Of the substep under way.
  ContactNumbers contact_numbers() const { return {contact_cloths, controls, substep}; }
  bool all_have_remainders() const {
    return cloths_with_remainders == (uint32_t{1} << kClothCount) - 1;
  }
  bool has_hinge_stages() const { return controls.plan.solver.hinge_stages > 0; }
  // Number of elastic elements, of triangles, or of places for cells, whichever is largest.
  size_t kick_count() const {
    const size_t triangles =
        controls.Has(StepStage::kApplyWind) ? model.source->triangles().size() : 0;
    const size_t cells = controls.plan.solver.has_elastic_lines ? model.particle_count : 0;
    const size_t forces = controls.grid_strengths == nullptr
                              ? model.source->elastic_elements().size() *
                                    model.source->elastic_shares().impulses_per_element
                              : (kAllKeptRows + kKeptPositions) * (model.grid_elements.columns + 2);
    return std::max({forces, triangles, cells});
  }
  // Number of accumulated impulses, in the places of the model, with padding.
  size_t impulse_count() const {
    const bool has_impulses = model.has_compliance() || model.has_inequalities();
    return has_impulses ? (model.groups.size() + 1) * kVec4Size : 0;
  }

  OwnPins own_pins;
  // Of each cloth, or the layout that they share: then nothing may be read that follows from pins.
  const FloatModel& model;
  const std::vector<ElasticGroup>& elastic_groups;  // of the first cloth
  const std::span<const uint32_t> free_particles;   // in some cloth, ascending
  const FloatControls& controls;  // of the first cloth: only what a group shares may be used
  const uint32_t max_iterations;  // sweeps per substep at most
  // The working memory, GroupScratch.
  ClothParticle* const particles;
  ClothParticle* const previous;
  const uint32_t cloths_with_remainders;  // one bit each
  ClothRemainders* const remainders;      // 0 in the lanes of the others
  VectorsCloths* const pin_targets;
  PairLinkSolution* const path_solution;
  VectorsPair* const end_directions;
  VecCloths* const distance_impulses;
  VectorsCloths* const twists;
  const ColliderReach& reach;  // only what a group shares
  ClothCollider* const colliders;
  ClothMotion* const motions;  // null: the colliders of all cloths rest as described
  VectorsCloths* const accelerations;
  VectorsCloths* const impulses;
  VectorsCloths* const predicted;
  VectorsCloths* const hinge_changes;
  VectorsCloths* const joint_impulses;
  Refinement& refinement;
  SimdMemory& mixed_links;       // of the refinement
  ClothContact* const contacts;  // [particle_count][collider_count]
  VecCloths* const quiet_round_offs;
  bool has_quiet_particles = false;  // any of them is not 0
  MaskCloths something_holds{};      // some contact, by friction, in this substep
  // These differ between the cloths.
  const VectorsCloths gravity;
  const VectorsCloths wind;
  const VecCloths air_drag, air_lift;
  const VecCloths end_share;
  const VecCloths span_give;
  const ContactCloths contact_cloths;
  VecCloths damping_factor = SplatCloths(1);              // of the substep under way
  bool has_damping = false;                               // some cloth has
  ClothBox range{};                                       // ColliderReach::range
  MaskCloths is_held = SplatCloths(0) >= SplatCloths(0);  // of those that have not left it
  FloatSubstep substep{};                                 // the one under way, but for the damping
  ClothFlight flight{};
  MaskCloths is_running{};  // those whose sweeps go on; the others stay as they are
  OpenStages open{};
  GroupImpulses* given = nullptr;  // null: nobody asks for impulses

 private:
  uint32_t HeldBy(uint32_t i) const { return own_pins.lists->held_by[i]; }
};

// The cloths that do not hold both ends of a link or joint.
MaskCloths IsLoose(const GroupContext& context, uint32_t i, uint32_t j) {
  return context.InverseMass(i) + context.InverseMass(j) > SplatCloths(0);
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
