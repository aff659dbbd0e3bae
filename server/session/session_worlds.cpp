// The methods of Session about cloths that touch each other.
#include <algorithm>
#include <utility>

#include "server/session/session.h"

namespace drape {
namespace {

// The name of the first setting that differs; empty: none does.
std::string_view DifferentSetting(const StepSettings& a, const StepSettings& b) {
  std::string_view name;
  ForEachSetting([&](const auto& setting) {
    if (name.empty() && a.*setting.member != b.*setting.member) name = setting.name;
  });
  return name;
}

}  // namespace

std::shared_ptr<const ClothRecord> Session::FirstOfWorld(const std::string& world) const {
  for (const auto& [number, cloth] : cloths_) {
    if (cloth->world == world) return cloth;
  }
  return nullptr;
}

Status Session::CheckWorld(const std::string& world, const SceneModel& model,
                           std::span<const StepSettings* const> settings) const {
  if (world.empty()) return Status::Ok();
  if (model.triangles().empty()) {
    return Status::InvalidField(
        "world", "belongs to cloths with triangles, made of a grid or a mesh; this one has none");
  }
  std::shared_ptr<const ClothRecord> first;
  size_t members = 0;
  {
    const std::lock_guard lock(mutex_);
    first = FirstOfWorld(world);
    members = static_cast<size_t>(std::ranges::count_if(
        cloths_, [&](const auto& entry) { return entry.second->world == world; }));
  }
  if (members + settings.size() > kMaxClothsPerWorld) {
    return {StatusCode::kResourceExhausted, "QUOTA_EXCEEDED",
            "a world has at most " + std::to_string(kMaxClothsPerWorld) +
                " cloths: " + std::to_string(members) + " in '" + world + "', " +
                std::to_string(settings.size()) + " more wanted"};
  }
  const auto description = first == nullptr ? nullptr : first->description();
  const StepSettings& theirs =
      description != nullptr ? description->parameters.settings : *settings[0];
  for (const StepSettings* const its : settings) {
    const std::string_view name = DifferentSetting(*its, theirs);
    if (name.empty()) continue;
    return Status::InvalidField("spec.settings." + std::string(name),
                                "differs from that of another cloth of the world '" + world +
                                    "': all of them have the same settings");
  }
  return Status::Ok();
}

void Session::JoinWorlds(const ClothList& cloths) {
  for (const auto& cloth : cloths) {
    if (cloth->world.empty() || !cloth->runtime->is_alive()) continue;
    std::shared_ptr<ClothWorld> world;
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(worlds_, [](const auto& entry) { return entry.second.expired(); });
      std::weak_ptr<ClothWorld>& named = worlds_[cloth->world];
      world = named.lock();
      if (world == nullptr) {
        world = std::make_shared<ClothWorld>(++commons_->worlds);
        named = world;
      }
    }
    cloth->runtime->Join(std::move(world), cloth->id.Packed(),
                         cloth->placement.WorldFromCloth(Eigen::Vector3d::Zero()));
  }
}

}  // namespace drape
