// Cloths that touch each other and are stepped together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "server/core/status.h"

namespace drape {

class ClothRuntime;

// Device thread, except number().
class ClothWorld {
 public:
  struct Member {
    ClothRuntime* cloth = nullptr;
    uint64_t id = 0;  // that clients see
    // Of its frame in that of the world [m].
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  };

  // A number that no other world of the scheduler has, not 0.
  explicit ClothWorld(uint64_t number) : number_(number) {}
  uint64_t number() const { return number_; }

  // In the order in which they joined, which decides the bits of their steps.
  const std::vector<Member>& members() const { return members_; }
  const Member& MemberOf(const ClothRuntime& cloth) const;

  // Ends the step requests of those that are there, which do not name the new one, and wakes all.
  void Join(const Member& member);
  // Those that are leaving (ClothRuntime) are members no longer, in one pass however many they are.
  // Wakes the others, which keep their order.
  void DropLeaving();

  // Whether all members have been watched alike: if not, nothing may sleep.
  bool AreWatchesAlike() const;
  // All members have been looked at: one that has moved keeps all awake, for as long as itself.
  void LevelWatches();

 private:
  const uint64_t number_;
  std::vector<Member> members_;
};

// FAILED_PRECONDITION WORLD_INCOMPLETE: a step names cloths of a world, but not these.
Status WorldIncomplete(const std::vector<uint64_t>& missing_ids);

}  // namespace drape
