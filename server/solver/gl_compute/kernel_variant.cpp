#include "server/solver/gl_compute/kernel_variant.h"

#include <algorithm>
#include <sstream>

#include "server/solver/collider_contact.h"
#include "server/solver/energy_watch.h"
#include "server/solver/gl_compute/kernel_costs.h"
#include "server/solver/gl_compute/local_sizes.h"
#include "server/solver/gl_compute/regular_strips.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "server/solver/gl_compute/strip_lanes.h"
#include "server/solver/gl_compute/strip_rows.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

constexpr uint32_t kLargestLocalSize = 1024;

const LocalSizes& SizesOf(const DeviceTraits& device) {
  return FindLocalSizes(MeasuredLocalSizes(), device.is_software, device.renderer);
}

uint32_t LocalSizeFor(uint32_t capacity, const DeviceTraits& device) {
  if (device.local_size != 0) return device.local_size;
  return SizesOf(device).ForCapacity(capacity);
}

Status LoopLimit() {
  return Status(StatusCode::kResourceExhausted, "KERNEL_LOOP_LIMIT",
                "a particle has too many springs, triangles or elastic elements, or the cloth too "
                "many colliders, colours or refined constraints, for the kernels of this device");
}

// One work group refines a tiled cloth, however large it is.
Status FitRefinement(const SceneModel& model, const DeviceTraits& device, KernelVariant& variant) {
  if (!variant.Has(StepStage::kRefine)) return Status::Ok();
  const uint32_t wanted =
      device.refine_local_size != 0 ? device.refine_local_size : device.local_size;
  variant.refine_local_size = wanted != 0 ? wanted : SizesOf(device).refine;
  while (CountTiledRefineLoops(model, variant.refine_local_size) > device.loop_budget) {
    if (variant.refine_local_size >= kLargestLocalSize) return LoopLimit();
    variant.refine_local_size *= 2;
  }
  return Status::Ok();
}

// One work group takes the self-contacts of a cloth. What would take more passes than the kernels
// allow themselves is left out, which must not happen in ordinary steps: else bits would depend on
// the local size.
Status FitSelfContacts(const SceneModel& model, const DeviceTraits& device,
                       KernelVariant& variant) {
  if (!variant.Has(StepStage::kFindSelfContacts)) return Status::Ok();
  if (model.particle_count() > kMaxSelfContactParticles) {
    return Status(StatusCode::kResourceExhausted, "SELF_CONTACT_LIMIT",
                  "a cloth with self_collision has at most " +
                      std::to_string(kMaxSelfContactParticles) + " particles on this backend");
  }
  variant.contact_loop_budget = device.loop_budget;
  variant.contact_local_size =
      device.local_size != 0 ? device.local_size : SizesOf(device).contacts;
  variant.contact_local_size = std::max(variant.contact_local_size, 8u);  // kOffers of the kernels
  while (CountContactWalk(model, variant.contact_local_size) > device.loop_budget / 8) {
    if (variant.contact_local_size >= kLargestLocalSize) return LoopLimit();
    variant.contact_local_size *= 2;
  }
  return Status::Ok();
}

// The way a strip is solved changes bits, and the local size must not.
StripSolve ChooseStripSolve(const SceneModel& model, uint32_t capacity,
                            const DeviceTraits& device) {
  const StripSet& strips = model.strips();
  if (device.strip_solve == StripSolve::kElimination) return device.strip_solve;
  if (capacity == 0) return StripSolve::kFromBothEnds;
  if (IsReduction(device.strip_solve) && FitsInLanes(model)) return device.strip_solve;
  return FitsInRows(strips, capacity) ? StripSolve::kFromBothEnds : StripSolve::kElimination;
}

// Whether lanes have so few links that they stay in registers.
bool KeepsLanes(const SceneModel& model, const KernelVariant& variant) {
  if (!IsReduction(variant.strip_solve) || model.strips().phase_count() > 2) return false;
  const uint32_t lane_count = LaneCount(variant.strip_solve, variant.local_size);
  return std::ranges::all_of(CountStripLanes(model),
                             [&](uint32_t lanes) { return lanes <= lane_count; });
}

// Cuts the step into parts where it is too long for one dispatch; more invocations per work group
// mean shorter loops.
Status FitLoops(const PlannedCloth& cloth, const DeviceTraits& device, VariantChoice& choice) {
  KernelVariant& variant = choice.variant;
  if (CountLongestLoop(cloth, variant.local_size, GeneralLocalSize(device)) > device.loop_budget) {
    return LoopLimit();
  }
  if (variant.is_tiled()) {
    DRAPE_RETURN_IF_ERROR(FitSelfContacts(cloth.model, device, variant));
    return FitRefinement(cloth.model, device, variant);
  }
  const auto count = [&] {
    return CountResidentLoops(cloth, variant.local_size, variant.strip_solve);
  };
  choice.costs = count();
  while (!CanRunInParts(choice.costs, device.loop_budget)) {
    if (variant.local_size >= kLargestLocalSize) return LoopLimit();
    variant.local_size *= 2;
    choice.costs = count();
  }
  choice.part_count = CountParts(choice.costs, cloth.plan.schedule.size(),
                                 cloth.parameters.settings.max_iterations, device.loop_budget);
  if (choice.part_count > 1) variant.loop_budget = device.loop_budget;
  return Status::Ok();
}

// On hardware a group has an invocation per particle, or shared memory for each: half of that is
// worth a kernel of its own.
uint32_t CapacityFor(const PlannedCloth& cloth, const DeviceTraits& device) {
  if (!IsResident(cloth)) return 0;
  const uint32_t particles = cloth.model.particle_count();
  if (particles <= 64) return 64;
  if (particles <= 256) return 256;
  const bool has_half = device.strip_solve != StripSolve::kElimination;
  return has_half && particles <= 512 ? 512 : kMaxResidentParticles;
}

void AddColliderTraits(const ClothParameters& parameters, const DeviceTraits& device,
                       TraitSet& traits) {
  const bool has_contacts = !parameters.colliders.empty();
  const bool leaves_out = has_contacts && device.leaves_out_colliders;
  for (const Collider& collider : parameters.colliders) {
    const ShapeKind kind = collider.kind();
    traits.Add(kind, !IsInEveryKernel(kind));
    // A map is out of reach if the box around it is.
    traits.Add(ShapeKind::kBox, kind == ShapeKind::kDistanceMap && leaves_out);
  }
  traits.Add(Feature::kFriction, has_contacts && parameters.friction_static > 0);
  traits.Add(Feature::kRestitution, HasRestitution(parameters));
  traits.Add(Feature::kMovingColliders, HasMovingColliders(parameters));
  traits.Add(Feature::kColliderReach, leaves_out);
}

TraitSet TraitsOf(const PlannedCloth& cloth, const DeviceTraits& device) {
  const SceneModel& model = cloth.model;
  const SolverChoice& solver = cloth.plan.solver;
  TraitSet traits;
  traits.Add(cloth.plan.stages);
  traits.Add(Feature::kSpringForces, solver.has_spring_forces);
  traits.Add(Feature::kCompliance, model.has_compliance());
  traits.Add(Feature::kInequalities, model.has_inequalities());
  traits.Add(Feature::kOwnLengths, cloth.has_own_lengths());
  traits.Add(Feature::kJointCompliance, model.has_joint_compliance());
  AddColliderTraits(cloth.parameters, device, traits);
  traits.Add(Feature::kDamping, cloth.parameters.damping_per_s > 0);
  traits.Add(Feature::kPins, model.pin_count() + cloth.parameters.max_grips > 0);
  traits.Add(Feature::kGrips, cloth.parameters.max_grips > 0);
  traits.Add(Feature::kEnergyWatch,
             EnergyLimitOf(model, cloth.parameters, cloth.lengths, cloth.plan).is_watched);
  traits.Add(Feature::kTolerance, cloth.plan.tolerance > 0);
  traits.Add(Feature::kTwoFrictions, cloth.has_two_frictions());
  traits.Add(Feature::kTwoSteps, solver.has_two_steps);
  traits.Add(Feature::kSpansThatGive, solver.span_give > 0);
  traits.Add(Feature::kQuietLinks, solver.has_quiet_links);
  traits.Add(Feature::kRemainders, solver.always_has_remainders());
  traits.Add(Feature::kHingeAngles, model.elastic_shares().impulses_per_element > 1);
  traits.Add(Feature::kStartDirections, solver.has_start_directions());
  traits.Add(Feature::kRegularStrips,
             solver.has_strips && device.finds_regular_strips && !FindRegularStrips(model).empty());
  return traits;
}

}  // namespace

bool KernelsCanStep(const SceneModel& model, const ClothParameters& parameters) {
  return !parameters.is_in_world && !HasBodies(parameters.colliders) &&
         !HasSurfaceContactsUnpulled(model, parameters);
}

std::string KernelVariant::Defines() const {
  std::ostringstream text;
  if (strip_solve == StripSolve::kReduction) {
    text << "#extension GL_KHR_shader_subgroup_basic : require\n"
         << "#extension GL_KHR_shader_subgroup_ballot : require\n"
         << "#extension GL_KHR_shader_subgroup_shuffle : require\n"
         << "#define HAS_SUBGROUPS\n";
  }
  if (IsReduction(strip_solve)) text << "#define HAS_STRIP_REDUCTION\n";
  if (has_lane_quads) text << "#define LANE_QUADS\n";
  if (keeps_lanes) text << "#define KEEPS_LANES\n";
  if (strip_solve == StripSolve::kFromBothEnds) {
    text << "#define HAS_STRIP_HALVES\n"
         << "#define STRIP_ROWS " << (is_tiled() ? local_size : capacity) << "\n";
  }
  if (shares_record) text << "#define SHARES_RECORD\n";
  if (!is_tiled()) text << "#define CAPACITY " << capacity << "\n";
  if (!is_tiled() && local_size >= capacity) text << "#define OWNS_PARTICLE\n";
  text << "#define LOCAL_SIZE " << local_size << "\n";
  if (contact_loop_budget > 0)
    text << "#define CONTACT_LOOP_BUDGET " << contact_loop_budget << "u\n";
  if (is_in_parts()) text << "#define LOOP_BUDGET " << loop_budget << "u\n";
  text << traits.Defines();
  return text.str();
}

bool IsResident(const SceneModel& model, bool touches_itself) {
  return !touches_itself && model.particle_count() <= kMaxResidentParticles &&
         model.constraint_count() <= kMaxResidentConnections &&
         model.joint_count() <= kMaxResidentConnections &&
         model.spring_count() <= kMaxResidentConnections &&
         model.elastic_count() <= kMaxResidentConnections;
}

std::string KernelPlan(const SceneModel& model, const ClothParameters& parameters) {
  return IsResident(model, parameters.self_collision.has_value()) ? "resident" : "tiled";
}

bool IsResident(const PlannedCloth& cloth) {
  return IsResident(cloth.model, cloth.plan.Has(StepStage::kFindSelfContacts));
}

Result<VariantChoice> ChooseVariant(const PlannedCloth& cloth, const DeviceTraits& device) {
  VariantChoice choice;
  KernelVariant& variant = choice.variant;
  variant.capacity = CapacityFor(cloth, device);
  variant.local_size = LocalSizeFor(variant.capacity, device);
  variant.traits = TraitsOf(cloth, device);
  if (variant.Has(StepStage::kSolveStrips)) {
    variant.strip_solve = ChooseStripSolve(cloth.model, variant.capacity, device);
  }
  variant.shares_record = device.shares_record && !variant.is_tiled();
  if (IsReduction(variant.strip_solve)) {
    variant.has_lane_quads = HasLaneQuads(cloth.model);
    variant.local_size = std::max(variant.local_size, DRAPE_STRIP_LANES);
  }
  // An invocation has one link of a phase.
  const bool has_rows = variant.strip_solve == StripSolve::kFromBothEnds;
  if (has_rows && !variant.is_tiled()) variant.local_size = variant.capacity;
  if (variant.Has(StepStage::kSolveStrips) && variant.is_tiled()) {
    variant.strip_local_size = has_rows ? LeastRows(cloth.model.strips()) : variant.local_size;
  }
  DRAPE_RETURN_IF_ERROR(FitLoops(cloth, device, choice));
  variant.keeps_lanes = KeepsLanes(cloth.model, variant);
  return choice;
}

uint32_t GeneralLocalSize(const DeviceTraits& device) {
  // `measure_pieces` keeps 52 bytes per invocation in shared memory.
  constexpr uint32_t kMostGeneral = 256;
  if (device.local_size != 0) return std::min(device.local_size, kMostGeneral);
  return SizesOf(device).general;
}

}  // namespace drape
