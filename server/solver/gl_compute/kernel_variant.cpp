#include "server/solver/gl_compute/kernel_variant.h"

#include <algorithm>
#include <sstream>

#include "server/solver/gl_compute/kernel_costs.h"
#include "server/solver/gl_compute/local_sizes.h"
#include "server/solver/gl_compute/plan_on_device.h"
#include "server/solver/gl_compute/regular_strips.h"
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

template <class Shape>
bool HasCollider(const ClothParameters& parameters) {
  return std::ranges::any_of(parameters.colliders, [](const Collider& collider) {
    return std::holds_alternative<Shape>(collider);
  });
}

Status LoopLimit() {
  return Status(StatusCode::kResourceExhausted, "KERNEL_LOOP_LIMIT",
                "a particle has too many springs, triangles or elastic elements, or the cloth too "
                "many colliders, colours or refined constraints, for the kernels of this device");
}

// One work group refines a tiled cloth, however large it is.
Status FitRefinement(const SceneModel& model, const DeviceTraits& device, KernelVariant& variant) {
  if (!variant.has_refinement) return Status::Ok();
  const uint32_t wanted =
      device.refine_local_size != 0 ? device.refine_local_size : device.local_size;
  variant.refine_local_size = wanted != 0 ? wanted : SizesOf(device).refine;
  while (CountTiledRefineLoops(model, variant.refine_local_size) > device.loop_budget) {
    if (variant.refine_local_size >= kLargestLocalSize) return LoopLimit();
    variant.refine_local_size *= 2;
  }
  return Status::Ok();
}

// What each invocation of a work group is given to do must not decide how a strip is solved, for
// that would change bits: so it goes by the local size that suits the device.
StripSolve ChooseStripSolve(const SceneModel& model, uint32_t capacity,
                            const DeviceTraits& device) {
  const StripSet& strips = model.strips();
  if (LongestStrip(strips) > DRAPE_STRIP_LANES) return StripSolve::kElimination;
  if (device.strip_solve != StripSolve::kReduction) return device.strip_solve;
  DeviceTraits usual = device;
  usual.local_size = 0;
  const uint32_t local_size = std::max(LocalSizeFor(capacity, usual), DRAPE_STRIP_LANES);
  return IsReductionShorter(strips, local_size) ? StripSolve::kReduction : StripSolve::kElimination;
}

// Cuts the step into parts where it is too long for one dispatch; more invocations per work group
// mean shorter loops.
Status FitLoops(const SceneModel& model, const ClothParameters& parameters,
                const DeviceTraits& device, VariantChoice& choice) {
  KernelVariant& variant = choice.variant;
  if (CountLongestLoop(model, parameters, variant.local_size, GeneralLocalSize(device)) >
      device.loop_budget) {
    return LoopLimit();
  }
  if (variant.is_tiled()) return FitRefinement(model, device, variant);
  const auto count = [&] {
    return CountResidentLoops(model, parameters, variant.local_size, variant.has_own_lengths,
                              variant.strip_solve);
  };
  LoopCosts costs = count();
  while (!CanRunInParts(costs, device.loop_budget)) {
    if (variant.local_size >= kLargestLocalSize) return LoopLimit();
    variant.local_size *= 2;
    costs = count();
  }
  choice.part_count = CountParts(costs, parameters.settings, device.loop_budget);
  variant.is_in_parts = choice.part_count > 1;
  if (variant.is_in_parts) variant.loop_budget = device.loop_budget;
  return Status::Ok();
}

}  // namespace

std::string KernelVariant::Defines() const {
  std::ostringstream text;
  if (strip_solve == StripSolve::kReduction) {
    text << "#extension GL_KHR_shader_subgroup_basic : require\n"
         << "#extension GL_KHR_shader_subgroup_shuffle : require\n"
         << "#define HAS_SUBGROUPS\n";
  }
  if (strip_solve != StripSolve::kElimination) text << "#define HAS_LANES\n";
  if (!is_tiled()) text << "#define CAPACITY " << capacity << "\n";
  text << "#define LOCAL_SIZE " << local_size << "\n";
  if (springs == Springs::kInForce) text << "#define SPRINGS_IN_FORCE\n";
  if (springs == Springs::kHalfKicks) text << "#define SPRINGS_HALF_KICKS\n";
  if (has_compliance) text << "#define HAS_COMPLIANCE\n";
  if (has_inequalities) text << "#define HAS_INEQUALITIES\n";
  if (has_own_lengths) text << "#define HAS_OWN_LENGTHS\n";
  if (has_joints) text << "#define HAS_JOINTS\n";
  if (has_joint_compliance) text << "#define HAS_JOINT_COMPLIANCE\n";
  if (has_contacts) text << "#define HAS_CONTACTS\n";
  if (has_capsules) text << "#define HAS_CAPSULES\n";
  if (has_boxes) text << "#define HAS_BOXES\n";
  if (has_distance_maps) text << "#define HAS_DISTANCE_MAPS\n";
  if (has_friction) text << "#define HAS_FRICTION\n";
  if (has_restitution) text << "#define HAS_RESTITUTION\n";
  if (has_moving_colliders) text << "#define HAS_MOVING_COLLIDERS\n";
  if (leaves_out_colliders) text << "#define LEAVES_OUT_COLLIDERS\n";
  if (has_damping) text << "#define HAS_DAMPING\n";
  if (has_pins) text << "#define HAS_PINS\n";
  if (has_tethers) text << "#define HAS_TETHERS\n";
  if (has_elastic) text << "#define HAS_ELASTIC\n";
  if (has_wind) text << "#define HAS_WIND\n";
  if (has_tolerance) text << "#define HAS_TOLERANCE\n";
  if (has_two_steps) text << "#define HAS_TWO_STEPS\n";
  if (has_twist) text << "#define HAS_TWIST\n";
  if (has_start_directions) text << "#define HAS_START_DIRECTIONS\n";
  if (has_velocity_stage) text << "#define HAS_VELOCITY_STAGE\n";
  if (has_strips) text << "#define HAS_STRIPS\n";
  if (has_regular_strips) text << "#define HAS_REGULAR_STRIPS\n";
  if (has_colours) text << "#define HAS_COLOURS\n";
  if (has_refinement) text << "#define HAS_REFINEMENT\n";
  if (is_in_parts) text << "#define IS_IN_PARTS\n#define LOOP_BUDGET " << loop_budget << "u\n";
  return text.str();
}

bool IsResident(const SceneModel& model) {
  return model.particle_count() <= kMaxResidentParticles &&
         model.constraint_count() <= kMaxResidentConnections &&
         model.joint_count() <= kMaxResidentConnections &&
         model.spring_count() <= kMaxResidentConnections &&
         model.elastic_count() <= kMaxResidentConnections;
}

Result<VariantChoice> ChooseVariant(const SceneModel& model, const ClothParameters& parameters,
                                    const DeviceTraits& device, bool has_own_lengths) {
  VariantChoice choice;
  KernelVariant& variant = choice.variant;
  if (IsResident(model)) {
    variant.capacity = model.particle_count() <= 64    ? 64
                       : model.particle_count() <= 256 ? 256
                                                       : kMaxResidentParticles;
  }
  variant.local_size = LocalSizeFor(variant.capacity, device);
  if (model.spring_count() > 0) {
    variant.springs = parameters.settings.spring_integration == SpringIntegration::kInForce
                          ? KernelVariant::Springs::kInForce
                          : KernelVariant::Springs::kHalfKicks;
  }
  variant.has_compliance = model.has_compliance();
  variant.has_inequalities = model.has_inequalities();
  variant.has_own_lengths = has_own_lengths;
  variant.has_joints = model.joint_count() > 0;
  variant.has_joint_compliance = model.has_joint_compliance();
  variant.has_contacts = !parameters.colliders.empty();
  variant.has_capsules = HasCollider<CapsuleCollider>(parameters);
  variant.has_distance_maps = HasCollider<DistanceMapCollider>(parameters);
  variant.leaves_out_colliders = variant.has_contacts && device.leaves_out_colliders;
  // Whether a map is out of reach goes by the box around it.
  variant.has_boxes = HasCollider<BoxCollider>(parameters) ||
                      (variant.has_distance_maps && variant.leaves_out_colliders);
  variant.has_friction = variant.has_contacts && parameters.friction_static > 0;
  variant.has_restitution = HasRestitution(parameters);
  variant.has_moving_colliders = HasMovingColliders(parameters);
  variant.has_damping = parameters.damping_per_s > 0;
  variant.has_pins = model.pin_count() > 0;
  variant.has_tethers = HasTethers(model, parameters.settings) && !has_own_lengths;
  variant.has_elastic = model.elastic_count() > 0;
  variant.has_wind = HasAirForces(model, parameters);
  variant.has_tolerance = parameters.settings.tolerance > 0;
  const SolverChoice solver = PlanOnDevice(model, parameters, has_own_lengths).solver;
  variant.has_two_steps = solver.has_two_steps;
  variant.has_twist = HasTwistDamping(model, parameters.settings);
  variant.has_start_directions = solver.end_share < 1;
  variant.has_velocity_stage = solver.velocity_iterations > 0;
  variant.has_strips = solver.has_strips;
  variant.has_regular_strips =
      solver.has_strips && device.finds_regular_strips && !FindRegularStrips(model).empty();
  if (solver.has_strips && !variant.is_tiled()) {
    variant.strip_solve = ChooseStripSolve(model, variant.capacity, device);
  }
  if (variant.strip_solve != StripSolve::kElimination) {
    variant.local_size = std::max(variant.local_size, DRAPE_STRIP_LANES);
  }
  variant.has_colours = !solver.has_strips;
  variant.has_refinement = solver.refine_above_strain > 0;
  DRAPE_RETURN_IF_ERROR(FitLoops(model, parameters, device, choice));
  return choice;
}

uint32_t GeneralLocalSize(const DeviceTraits& device) {
  // `measure_pieces` keeps 52 bytes per invocation in shared memory.
  constexpr uint32_t kMostGeneral = 256;
  if (device.local_size != 0) return std::min(device.local_size, kMostGeneral);
  return SizesOf(device).general;
}

}  // namespace drape
