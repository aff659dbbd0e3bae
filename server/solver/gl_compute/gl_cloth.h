// One cloth as the host sees it, and how it is described to the kernels.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/gl_compute/collider_looks.h"
#include "server/solver/gl_compute/device_map.h"
#include "server/solver/gl_compute/device_model.h"
#include "server/solver/gl_compute/free_list.h"
#include "server/solver/gl_compute/kernel_costs.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/step_report.h"
#include "shaders/interface/cloth_record.h"

namespace drape {

// Word offsets of a cloth's arrays from the start of its range in Scratch; contents as in
// shaders/interface/cloth_record.h.
struct ScratchLayout {
  uint64_t lambdas = 0;
  uint64_t joint_lambdas = 0;
  uint64_t normal_betas = 0;
  uint64_t tangent_betas = 0;
  uint64_t rebounds = 0;
  uint64_t violations = 0;
  uint64_t met_colliders = 0;
  uint64_t spring_accelerations = 0;
  uint64_t elastic_impulses = 0;
  uint64_t air_impulses = 0;
  uint64_t previous_positions = 0;
  uint64_t previous_velocities = 0;
  uint64_t twist_changes = 0;
  uint64_t strip_links = 0;
  uint64_t far_off_flags = 0;
  uint64_t refined_links = 0;
  uint64_t work_positions = 0;
  uint64_t work_velocities = 0;
  uint64_t measured_pieces = 0;
  uint64_t size = 0;
};

// Pure. `has_work_state`: the step's own copy of the state lies in Scratch.
ScratchLayout LayOutScratch(const SceneModel& model, const ClothParameters& parameters,
                            bool has_work_state);

// Work groups that measure a cloth.
uint32_t MeasurePieceCount(const SceneModel& model);

struct GlCloth {
  std::shared_ptr<const DeviceModel> model;
  std::vector<std::shared_ptr<const DeviceMap>> maps{};  // of the distance maps, in their order
  ClothParameters parameters;
  const StepKernels* kernels = nullptr;
  // The same for steps that do not look for colliders out of reach; null until there is one.
  const StepKernels* kernels_without_look = nullptr;
  ColliderLooks looks;
  uint64_t part_count = 1;      // dispatches of the resident step
  LoopCosts costs;              // of the resident step
  uint32_t max_iterations = 0;  // sweeps per substep at most, of the step under way
  double tolerance = 0;         // the one used: what single precision can meet
  FaultReason fault = FaultReason::kNone;
  WordRange state;  // positions, then velocities
  // Pin targets, colliders, their motions, own rest lengths (starts, then targets).
  WordRange parameter_words;
  WordRange scratch;

  // How the colliders move in the last step, as packed; empty: they rest as described.
  std::vector<uint32_t> motion_words;

  // Rest lengths of the cloth's own at the end of the last step, [constraint_count] float bits;
  // empty: those of the model.
  std::vector<uint32_t> length_words;
  bool are_lengths_moving = false;  // the last step changed them

  // Those of the next step.
  const StepKernels* next_kernels() const {
    return looks.is_due() || kernels_without_look == nullptr ? kernels : kernels_without_look;
  }
  bool has_own_lengths() const { return !length_words.empty(); }
  uint32_t particle_count() const { return model->model->particle_count(); }
  uint32_t pin_count() const { return model->model->pin_count(); }
  bool has_work_state() const {
    return kernels->variant.is_tiled() || kernels->variant.is_in_parts;
  }
};

// Pure.
shader::ClothRecord MakeClothRecord(const GlCloth& cloth);

// Words of Parameters: pin targets (3 per pin, float bits), colliders, their motions, rest lengths
// of the cloth's own (2 per constraint).
uint64_t ParameterWordCount(const SceneModel& model, const ClothParameters& parameters,
                            bool has_own_lengths = false);
// Where the rest lengths begin in a cloth's words of Parameters.
uint32_t LengthsOffset(const SceneModel& model, const ClothParameters& parameters);
std::vector<uint32_t> PackLengths(std::span<const double> rest_lengths_m);
// Where the motions of the colliders begin in a cloth's words of Parameters.
uint32_t MotionsOffset(const SceneModel& model, const ClothParameters& parameters);
// For substeps of so long.
std::vector<uint32_t> PackMotions(std::span<const RigidMotion> motions, double substep_s);
std::vector<uint32_t> PackTargets(std::span<const Eigen::Vector3d> targets_m);
// `maps`: those of the distance maps among the colliders, in their order.
std::vector<uint32_t> PackColliders(std::span<const Collider> colliders,
                                    std::span<const std::shared_ptr<const DeviceMap>> maps = {});
// Positions, then velocities.
std::vector<float> PackState(const ParticleState& state);
// Where the pins of the model are in a state.
std::vector<Eigen::Vector3d> PinPositions(const SceneModel& model, const ParticleState& state);

}  // namespace drape
