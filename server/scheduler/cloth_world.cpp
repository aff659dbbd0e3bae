#include "server/scheduler/cloth_world.h"

#include <algorithm>
#include <string>

#include "server/core/check.h"
#include "server/scheduler/active_request.h"
#include "server/scheduler/cloth_runtime.h"

namespace drape {

const ClothWorld::Member& ClothWorld::MemberOf(const ClothRuntime& cloth) const {
  const auto found = std::ranges::find(members_, &cloth, &Member::cloth);
  DRAPE_CHECK(found != members_.end(), "a cloth is a member of its world");
  return *found;
}

void ClothWorld::Join(const Member& member) {
  for (const Member& other : members_) {
    for (ActiveRequest* const request : other.cloth->turns()) {
      request->EndWith(WorldIncomplete({member.id}));
    }
    other.cloth->sleep().Wake();
  }
  members_.push_back(member);
}

void ClothWorld::DropLeaving() {
  std::erase_if(members_, [](const Member& member) {
    if (!member.cloth->is_leaving()) return false;
    member.cloth->ForgetWorld();
    return true;
  });
  for (const Member& other : members_) other.cloth->sleep().Wake();
}

bool ClothWorld::AreWatchesAlike() const {
  return std::ranges::all_of(members_, [&](const Member& member) {
    return member.cloth->sleep().IsAsFarAs(members_[0].cloth->sleep());
  });
}

void ClothWorld::LevelWatches() {
  if (AreWatchesAlike()) return;
  uint64_t patience = 0;
  for (const Member& member : members_) {
    const SleepWatch::State& watch = member.cloth->sleep().state();
    if (!watch.is_watching) patience = std::max(patience, watch.patience);
  }
  for (const Member& member : members_) member.cloth->sleep().Wait(patience);
}

Status WorldIncomplete(const std::vector<uint64_t>& missing_ids) {
  constexpr size_t kMostNamed = 16;
  std::string text = "all cloths of a world are stepped together, but the request does not name";
  for (size_t k = 0; k < std::min(missing_ids.size(), kMostNamed); ++k) {
    text += (k == 0 ? " " : ", ") + std::to_string(missing_ids[k]);
  }
  if (missing_ids.size() > kMostNamed) {
    text += " and " + std::to_string(missing_ids.size() - kMostNamed) + " more";
  }
  return {StatusCode::kFailedPrecondition, "WORLD_INCOMPLETE", text};
}

}  // namespace drape
