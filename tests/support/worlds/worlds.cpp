#include "tests/support/worlds/worlds.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "server/solver/self_contact/exact_orientation.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Exactly representable in single precision, so that shifts change no start by more than rounding.
Vector3d OriginOf(const Scene& scene) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : scene.state.positions_m) sum += p;
  return RoundToFloat(sum / static_cast<double>(scene.state.positions_m.size()));
}

}  // namespace

ClothWorld::ClothWorld(Backend& backend, uint64_t world, std::vector<Scene> scenes)
    : backend_(backend), world_(world), scenes_(std::move(scenes)) {
  for (const Scene& scene : scenes_) {
    origins_m_.push_back(OriginOf(scene));
    Scene in_own_frame = scene;
    for (Vector3d& p : in_own_frame.state.positions_m) p -= origins_m_.back();
    for (Collider& collider : in_own_frame.parameters.colliders) {
      collider.pose.position_m -= origins_m_.back();
    }
    cloths_.push_back(CreateCloth(backend_, in_own_frame));
  }
}

ClothWorld::~ClothWorld() {
  for (const ClothHandle cloth : cloths_) backend_.Destroy(cloth);
}

std::vector<StepItem> ClothWorld::Items(bool measure) const {
  std::vector<StepItem> items;
  for (size_t k = 0; k < cloths_.size(); ++k) {
    StepItem item;
    item.cloth = cloths_[k];
    item.measure = measure;
    item.world = {world_, origins_m_[k]};
    items.push_back(item);
  }
  return items;
}

std::vector<StepReport> ClothWorld::Step(uint32_t steps, bool measure) {
  const std::vector<StepItem> items = Items(measure);
  std::vector<StepReport> reports;
  for (uint32_t k = 0; k < steps; ++k) reports = backend_.Step(items).reports;
  return reports;
}

ParticleState ClothWorld::State(size_t index) const {
  ParticleState state = ReadState(backend_, cloths_[index]);
  for (Vector3d& p : state.positions_m) p += origins_m_[index];
  return state;
}

std::string ClothWorld::Bits() const {
  std::string bits;
  for (const ClothHandle cloth : cloths_) bits += ReadBits(backend_, cloth);
  return bits;
}

size_t ClothWorld::Crossings() const {
  std::vector<Vector3d> positions_m;
  std::vector<std::array<size_t, 3>> triangles;
  for (size_t k = 0; k < cloths_.size(); ++k) {
    const size_t first = positions_m.size();
    for (const auto& [a, b, c] : scenes_[k].model->triangles()) {
      triangles.push_back({first + a, first + b, first + c});
    }
    const ParticleState state = State(k);
    positions_m.insert(positions_m.end(), state.positions_m.begin(), state.positions_m.end());
  }
  const auto box_of = [&](const auto& corners) {
    Eigen::AlignedBox3d box;
    for (const size_t i : corners) box.extend(positions_m[i]);
    return box;
  };
  std::set<std::array<size_t, 2>> edges;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const auto& triangle : triangles) {
    boxes.push_back(box_of(triangle));
    for (size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      edges.insert({low, high});
    }
  }
  size_t crossings = 0;
  for (const auto& edge : edges) {
    const Eigen::AlignedBox3d box = box_of(edge);
    for (size_t t = 0; t < triangles.size(); ++t) {
      if (!box.intersects(boxes[t])) continue;
      const auto& [a, b, c] = triangles[t];
      const auto is_corner = [&](size_t i) { return i == a || i == b || i == c; };
      if (is_corner(edge[0]) || is_corner(edge[1])) continue;
      crossings += self_contact::Crosses(positions_m[edge[0]], positions_m[edge[1]], positions_m[a],
                                         positions_m[b], positions_m[c]);
    }
  }
  return crossings;
}

}  // namespace drape::test
