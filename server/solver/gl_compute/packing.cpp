#include "server/solver/gl_compute/packing.h"

#include <numbers>

#include "server/solver/hinge_stages.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

void AppendVector(const Eigen::Vector3d& v, std::vector<uint32_t>& words) {
  for (int axis = 0; axis < 3; ++axis) words.push_back(FloatWord(v[axis]));
}

}  // namespace

std::vector<uint32_t> PackElasticEntries(const SceneModel& model, double s_s2) {
  std::vector<uint32_t> words;
  for (const ElasticEntry& entry : DecomposeElasticLines(
           model.elastic_lines(), model.inverse_masses_per_kg(), model.grid_columns(), s_s2)) {
    words.insert(words.end(), {FloatWord(entry.elasticity), FloatWord(entry.inverse_pivot),
                               FloatWord(entry.to_next), FloatWord(entry.to_second_next)});
  }
  return words;
}

std::vector<uint32_t> PackHingeStages(uint32_t count) {
  std::vector<uint32_t> words;
  for (const auto& [momentum, gain] : HingeStages(count)) {
    words.insert(words.end(), {FloatWord(momentum), FloatWord(gain)});
  }
  return words;
}

std::vector<uint32_t> PackLengths(std::span<const double> rest_lengths_m) {
  std::vector<uint32_t> words;
  for (const double length : rest_lengths_m) words.push_back(FloatWord(length));
  return words;
}

std::vector<uint32_t> PackTargets(std::span<const Eigen::Vector3d> targets_m) {
  std::vector<uint32_t> words;
  for (const Eigen::Vector3d& target : targets_m) AppendVector(target, words);
  return words;
}

std::vector<uint32_t> PackColliders(std::span<const Collider> colliders,
                                    std::span<const std::shared_ptr<const DeviceMap>> maps) {
  std::vector<uint32_t> words;
  size_t map_count = 0;
  for (const Collider& collider : colliders) {
    const ColliderNumbers numbers = NumbersOf(collider);
    words.push_back(static_cast<uint32_t>(collider.kind()));
    words.push_back(FloatWord(numbers.radius_m));
    AppendVector(numbers.point_m, words);
    AppendVector(numbers.vector, words);
    for (int k = 0; k < 3; ++k) AppendVector(numbers.axes.col(k), words);
    const bool is_map = collider.kind() == ShapeKind::kDistanceMap;
    words.push_back(is_map ? maps[map_count++]->words.begin() : 0);
  }
  return words;
}

std::vector<uint32_t> PackMotions(std::span<const RigidMotion> motions, double substep_s) {
  std::vector<uint32_t> words;
  for (const RigidMotion& motion : motions) {
    const double rate = motion.angular_velocity_rad_per_s.norm();
    const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
    const ChordFactors chord = motion.ChordOver(substep_s);
    AppendVector(motion.pivot_m, words);
    AppendVector(motion.position_m, words);
    for (int k = 0; k < 3; ++k) AppendVector(rotation.col(k), words);
    AppendVector(motion.velocity_m_per_s, words);
    const Eigen::Vector3d axis = motion.angular_velocity_rad_per_s / (rate > 0 ? rate : 1);
    AppendVector(axis, words);
    AppendVector(motion.angular_velocity_rad_per_s, words);
    words.push_back(FloatWord(rate / (2 * std::numbers::pi)));
    words.push_back(FloatWord(chord.sine));
    words.push_back(FloatWord(chord.cosine_s));
  }
  return words;
}

std::vector<float> PackState(const ParticleState& state) {
  std::vector<float> packed;
  packed.reserve(3 * (state.positions_m.size() + state.velocities_m_per_s.size()));
  for (const auto* vectors : {&state.positions_m, &state.velocities_m_per_s}) {
    for (const Eigen::Vector3d& v : *vectors) {
      for (int axis = 0; axis < 3; ++axis) packed.push_back(static_cast<float>(v[axis]));
    }
  }
  return packed;
}

std::vector<Eigen::Vector3d> PinPositions(const SceneModel& model, const ParticleState& state) {
  std::vector<Eigen::Vector3d> positions;
  for (const uint32_t pin : model.pins()) positions.push_back(state.positions_m[pin]);
  return positions;
}

}  // namespace drape
