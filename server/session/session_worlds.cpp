// The methods of Session about cloths that touch each other.
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

void Session::EnterWorld(const ClothRecord& cloth) {
  if (!cloth.world.empty()) worlds_[cloth.world].cloths.insert(cloth.creation_number);
}

void Session::LeaveWorld(const ClothRecord& cloth) {
  const auto world = worlds_.find(cloth.world);
  if (world == worlds_.end()) return;
  world->second.cloths.erase(cloth.creation_number);
  if (world->second.cloths.empty()) worlds_.erase(world);
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
    if (const auto named = worlds_.find(world); named != worlds_.end()) {
      members = named->second.cloths.size();
      first = cloths_.at(*named->second.cloths.begin());
    }
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
      const auto named = worlds_.find(cloth->world);
      if (named == worlds_.end()) continue;  // deleted already, it and all others
      world = named->second.world.lock();
      if (world == nullptr) {
        world = std::make_shared<ClothWorld>(++commons_->worlds);
        named->second.world = world;
      }
    }
    cloth->runtime->Join(std::move(world), cloth->id.Packed(),
                         cloth->placement.WorldFromCloth(Eigen::Vector3d::Zero()));
  }
}

}  // namespace drape
