// A cloth's parameters and state as the words that kernels read. Pure.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/particle_state.h"
#include "server/scene/rigid_motion.h"
#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/device_map.h"

namespace drape {

// The bits of the value in single precision.
inline uint32_t FloatWord(double value) {
  return std::bit_cast<uint32_t>(static_cast<float>(value));
}

std::vector<uint32_t> PackTargets(std::span<const Eigen::Vector3d> targets_m);
// Layout: shaders/interface/bindings.h. `maps`: those of the distance maps among the colliders, in
// their order.
std::vector<uint32_t> PackColliders(std::span<const Collider> colliders,
                                    std::span<const std::shared_ptr<const DeviceMap>> maps = {});
// For substeps of `substep_s`.
std::vector<uint32_t> PackMotions(std::span<const RigidMotion> motions, double substep_s);
// What solves the lines of elastic elements (DecomposeElasticLines).
std::vector<uint32_t> PackElasticEntries(const SceneModel& model, double s_s2);
// HingeStages.
std::vector<uint32_t> PackHingeStages(uint32_t count);
std::vector<uint32_t> PackLengths(std::span<const double> rest_lengths_m);
// Positions, then velocities.
std::vector<float> PackState(const ParticleState& state);
// The positions of the model's pins in a state.
std::vector<Eigen::Vector3d> PinPositions(const SceneModel& model, const ParticleState& state);

}  // namespace drape
