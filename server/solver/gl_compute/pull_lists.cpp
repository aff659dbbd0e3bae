#include "server/solver/gl_compute/pull_lists.h"

#include <span>
#include <utility>

namespace drape {

uint64_t CountPullVectors(const SceneModel& model) {
  return uint64_t{model.constraint_count()} + model.joint_count() + model.tethers().size();
}

std::vector<uint32_t> PackPullLists(const SceneModel& model) {
  const uint32_t particles = model.particle_count();
  // visit(particle, entry): of every end of a link.
  const auto for_each = [&model](const auto& visit) {
    uint32_t vector = 0;
    const auto add_link = [&](uint32_t i, uint32_t j) {
      visit(i, vector << 1 | 1);
      visit(j, vector << 1);
      ++vector;
    };
    for (const DistanceConstraint& constraint : model.constraints()) {
      add_link(constraint.i, constraint.j);
    }
    for (const PointJoint& joint : model.joints()) add_link(joint.i, joint.j);
    for (const Tether& tether : model.tethers()) visit(tether.pin, vector++ << 1);
  };
  std::vector<uint32_t> words(particles + size_t{1}, 0);
  for_each([&words](uint32_t particle, uint32_t) { ++words[particle + 1]; });
  for (uint32_t i = 0; i < particles; ++i) words[i + 1] += words[i];
  std::vector<uint32_t> next(words.begin(), words.end() - 1);
  words.resize(words.size() + words.back());
  for_each([&](uint32_t particle, uint32_t entry) {
    words[particles + size_t{1} + next[particle]++] = entry;
  });
  return words;
}

Result<std::shared_ptr<const DevicePullLists>> PullListStore::Acquire(
    std::shared_ptr<const SceneModel> model) {
  const auto known = lists_.find(model.get());
  if (known != lists_.end()) {
    if (std::shared_ptr<const DevicePullLists> on_device = known->second.lock()) return on_device;
  }
  std::erase_if(lists_, [](const auto& entry) { return entry.second.expired(); });
  const std::vector<uint32_t> words = PackPullLists(*model);
  Result<WordRange> range = arena_->Allocate(words.size());
  if (!range.ok()) return range.status();
  auto on_device = std::make_shared<DevicePullLists>();
  on_device->words = std::move(range).value();
  arena_->Write(on_device->words, 0, std::span<const uint32_t>(words));
  lists_[model.get()] = on_device;
  on_device->model = std::move(model);
  return std::shared_ptr<const DevicePullLists>(on_device);
}

}  // namespace drape
