// The choice of the kernels that a cloth needs. Pure.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/kernel_costs.h"
#include "server/solver/gl_compute/kernel_traits.h"
#include "server/solver/gl_compute/planned_cloth.h"
#include "server/solver/gl_compute/strip_solve.h"

namespace drape {

// Not worlds, bodies, and edges and triangles that touch colliders: there is no stage for them.
bool KernelsCanStep(const SceneModel& model, const ClothParameters& parameters);

// The specialisation of a kernel: its code has only what the cloth needs. A function of the cloth
// and the device alone, never of a batch.
struct KernelVariant {
  // Particles that fit the shared memory of one work group: 64, 256, 512 or 1024; 0: the tiled
  // plan.
  uint32_t capacity = 0;
  uint32_t local_size = 0;  // invocations per work group
  // Invocations of a work group that solves strips of the tiled plan; else 0.
  uint32_t strip_local_size = 0;
  // Invocations of the work group that refines a cloth of the tiled plan; else 0.
  uint32_t refine_local_size = 0;
  // Invocations of the work group that takes the self-contacts of a cloth, and the passes through
  // loops that it may make; else 0.
  uint32_t contact_local_size = 0;
  uint32_t contact_loop_budget = 0;
  // The resident step takes several dispatches of at most this many passes through loops
  // (kernel_costs.h); 0: it takes one.
  uint32_t loop_budget = 0;
  StripSolve strip_solve = StripSolve::kElimination;
  bool has_lane_quads = false;  // HasLaneQuads
  bool keeps_lanes = false;     // each lane its links, in registers; changes no bit
  bool shares_record = false;   // of the cloth, among the invocations; changes no bit
  TraitSet traits;

  bool is_tiled() const { return capacity == 0; }
  bool is_in_parts() const { return loop_budget > 0; }
  bool Has(KernelTrait trait) const { return traits.Has(trait); }
  // The #define block that specialises the kernels.
  std::string Defines() const;

  friend auto operator<=>(const KernelVariant&, const KernelVariant&) = default;
};

// The properties of the device that the choice depends on.
struct DeviceTraits {
  bool is_software = false;
  std::string_view renderer = {};  // GL_RENDERER; the string must outlive this
  uint32_t local_size = 0;         // 0: what suits the device (local_sizes.h)
  uint32_t refine_local_size = 0;  // 0: like local_size
  uint32_t loop_budget = 0;        // passes through loops per dispatch and invocation
  // The way to solve strips. By reduction only short ones of resident cloths, the others from both
  // ends.
  StripSolve strip_solve = StripSolve::kElimination;
  // Whether resident kernels keep the record of their cloth in shared memory, where it takes no
  // registers.
  bool shares_record = false;
  // Whether steps leave out colliders that the cloth cannot meet; no bit depends on it.
  bool leaves_out_colliders = true;
  // Whether strips that are all regular are read without lists; no bit depends on it.
  bool finds_regular_strips = true;
};

// The largest cloth of the resident plan [particles]: 29 bytes each in the 32 KiB of shared memory
// that OpenGL 4.5 guarantees.
inline constexpr uint32_t kMaxResidentParticles = 1024;
// Meshes and nets of 1024 particles have 2 to 6 thousand of each; with far more of them a sweep
// gains nothing from shared memory.
inline constexpr uint32_t kMaxResidentConnections = 8 * 1024;

// Cloths that touch themselves are tiled.
bool IsResident(const SceneModel& model, bool touches_itself = false);
bool IsResident(const PlannedCloth& cloth);
// "resident" or "tiled".
std::string KernelPlan(const SceneModel& model, const ClothParameters& parameters);

// How a cloth is stepped.
struct VariantChoice {
  KernelVariant variant;
  LoopCosts costs;          // of the resident step
  uint64_t part_count = 1;  // dispatches of the resident step
};
// RESOURCE_EXHAUSTED (KERNEL_LOOP_LIMIT) for a cloth whose kernels would loop longer than the
// device allows.
Result<VariantChoice> ChooseVariant(const PlannedCloth& cloth, const DeviceTraits& device);

// Invocations of a work group that does not depend on the cloth (`measure_pieces`, `pack`).
uint32_t GeneralLocalSize(const DeviceTraits& device);

}  // namespace drape
