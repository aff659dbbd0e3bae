// Which parts of the step a cloth needs. Pure.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/gl_compute/strip_solve.h"

namespace drape {

// What a kernel is compiled for: what the cloth does not have is not in the code. A function of the
// cloth and the device alone, never of a batch.
struct KernelVariant {
  enum class Springs { kNone, kInForce, kHalfKicks };

  // Particles that fit the shared memory of one work group: 64, 256 or 1024; 0: the tiled plan.
  uint32_t capacity = 0;
  uint32_t local_size = 0;  // invocations per work group
  Springs springs = Springs::kNone;
  bool has_compliance = false;
  bool has_inequalities = false;
  bool has_own_lengths = false;  // rest lengths in the parameters, not in the model
  bool has_joints = false;
  bool has_joint_compliance = false;
  bool has_contacts = false;
  bool has_capsules = false;
  bool has_boxes = false;
  bool has_distance_maps = false;
  bool has_friction = false;
  bool has_restitution = false;
  bool has_moving_colliders = false;
  bool leaves_out_colliders = false;  // those that the cloth cannot meet within the step
  bool has_damping = false;
  bool has_pins = false;
  bool has_tethers = false;
  bool has_elastic = false;
  bool has_wind = false;  // drag or lift of the air, also in still air
  bool has_tolerance = false;
  bool has_two_steps = false;
  bool has_twist = false;
  bool has_start_directions = false;  // impulses not only along the directions at the end
  bool has_velocity_stage = false;
  bool has_strips = false;
  bool has_regular_strips = false;  // all of them, read as such
  StripSolve strip_solve = StripSolve::kElimination;
  bool has_colours = false;
  bool has_refinement = false;
  // Invocations of the work group that refines a cloth of the tiled plan; else 0.
  uint32_t refine_local_size = 0;
  // The resident step takes several dispatches of at most loop_budget passes (kernel_costs.h).
  bool is_in_parts = false;
  uint32_t loop_budget = 0;  // 0 unless is_in_parts

  bool is_tiled() const { return capacity == 0; }
  // The #define block that specialises the kernels.
  std::string Defines() const;

  friend auto operator<=>(const KernelVariant&, const KernelVariant&) = default;
};

// What of the device the choice depends on.
struct DeviceTraits {
  bool is_software = false;
  std::string_view renderer = {};  // GL_RENDERER; what it points to must live as long
  uint32_t local_size = 0;         // 0: what suits the device (local_sizes.h)
  uint32_t refine_local_size = 0;  // 0: like local_size
  uint32_t loop_budget = 0;        // passes through loops per dispatch and invocation
  // How strips are solved where they are short enough, with kReduction also only where it is the
  // shorter way (IsReductionShorter).
  StripSolve strip_solve = StripSolve::kElimination;
  // Whether steps leave out colliders that the cloth cannot meet; no bit depends on it.
  bool leaves_out_colliders = true;
  // Whether strips that are all regular are read as such; no bit depends on it.
  bool finds_regular_strips = true;
};

// The largest cloth of the resident plan [particles]: 29 bytes each in the 32 KiB of shared memory
// that OpenGL 4.5 guarantees.
inline constexpr uint32_t kMaxResidentParticles = 1024;
// Meshes and nets of 1024 particles have 2 to 6 thousand of each; with far more of them a sweep
// gains nothing from shared memory.
inline constexpr uint32_t kMaxResidentConnections = 8 * 1024;

bool IsResident(const SceneModel& model);

// How a cloth is stepped; `has_own_lengths`: it has rest lengths of its own. RESOURCE_EXHAUSTED
// (KERNEL_LOOP_LIMIT) for one whose kernels would loop longer than the device allows.
struct VariantChoice {
  KernelVariant variant;
  uint64_t part_count = 1;  // dispatches of the resident step
};
Result<VariantChoice> ChooseVariant(const SceneModel& model, const ClothParameters& parameters,
                                    const DeviceTraits& device, bool has_own_lengths = false);

// Invocations of a work group that does not depend on the cloth (`measure_pieces`, `pack`).
uint32_t GeneralLocalSize(const DeviceTraits& device);

}  // namespace drape
