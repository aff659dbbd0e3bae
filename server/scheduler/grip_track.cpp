#include "server/scheduler/grip_track.h"

#include <algorithm>
#include <variant>

#include "server/core/check.h"

namespace drape {

void GripTrack::Reset() {
  for (Slot& slot : slots_) slot = {};
  is_settled_ = false;
}

const GripTrack::Slot& GripTrack::At(uint32_t slot) const {
  DRAPE_CHECK(slot < slots_.size(), "no such slot");
  return slots_[slot];
}

bool GripTrack::Holds(uint32_t particle) const {
  return std::ranges::any_of(slots_, [&](const Slot& slot) { return slot.particle == particle; });
}

Eigen::Vector3d GripTrack::PositionAt(uint32_t slot, double time_s) const {
  return At(slot).motion.At(time_s);
}

void GripTrack::Grab(uint32_t slot, uint32_t particle, const Eigen::Vector3d& position_m,
                     const Eigen::Vector3d& place_m, double now_s, double largest_force_n) {
  for (Slot& other : slots_) {
    if (other.particle == particle) other = {};
  }
  At(slot) = {particle, position_m - place_m, {position_m, position_m, now_s, 0}, largest_force_n};
  is_settled_ = false;
}

void GripTrack::Hold(uint32_t slot, const Eigen::Vector3d& place_m, double over_s, double now_s) {
  Slot& held = At(slot);
  if (!held.particle) return;
  const Eigen::Vector3d goal_m = place_m + held.offset_m;
  // It rests there already, so the cloth may stay asleep.
  if (is_settled_ && held.motion.goal == goal_m) return;
  held.motion = {held.motion.At(now_s), goal_m, now_s, over_s};
  is_settled_ = false;
}

void GripTrack::Release(uint32_t slot) {
  if (!At(slot).particle) return;
  At(slot) = {};
  is_settled_ = false;
}

bool GripTrack::has_largest_forces() const {
  return std::ranges::any_of(
      slots_, [](const Slot& slot) { return slot.particle && slot.largest_force_n < kNoLimit_n; });
}

void GripTrack::OpenOverloaded(const StepImpulses& impulses, double duration_s) {
  for (size_t k = 0; k < impulses.gripped_particles.size(); ++k) {
    const double force_n = impulses.grips_n_s[k].norm() / duration_s;
    for (uint32_t slot = 0; slot < slots_.size(); ++slot) {
      if (slots_[slot].particle != impulses.gripped_particles[k]) continue;
      if (force_n > slots_[slot].largest_force_n) Release(slot);
    }
  }
}

void GripTrack::ReleasePins(const SceneModel& model) {
  for (uint32_t slot = 0; slot < slots_.size(); ++slot) {
    if (!slots_[slot].particle) continue;
    if (model.inverse_masses_per_kg()[*slots_[slot].particle] == 0) Release(slot);
  }
}

void GripTrack::Restore(std::vector<Slot> slots, bool is_settled) {
  slots_ = std::move(slots);
  is_settled_ = is_settled;
  grips_.clear();
  for (const Slot& slot : slots_) {
    if (slot.particle) grips_.push_back({*slot.particle, slot.motion.goal.value()});
  }
  std::ranges::sort(grips_, {}, &Grip::particle);
}

std::span<const Grip> GripTrack::GripsForStep(double end_s) {
  has_changed_ = !is_settled_;
  if (is_settled_) return grips_;
  grips_.clear();
  is_settled_ = true;
  for (const Slot& slot : slots_) {
    if (!slot.particle) continue;
    grips_.push_back({*slot.particle, slot.motion.TargetAt(end_s)});
    is_settled_ &= slot.motion.IsOver(end_s);
  }
  std::ranges::sort(grips_, {}, &Grip::particle);
  return grips_;
}

std::optional<uint32_t> NearestLoose(const SceneModel& model, const GripTrack& grips,
                                     const ScalarColumn& positions_m, size_t first_row,
                                     const Eigen::Vector3d& place_m, double radius_m) {
  return std::visit(
      [&](const auto& values) {
        std::optional<uint32_t> nearest;
        double least_sq = radius_m * radius_m;
        const auto* xyz = values.data() + 3 * first_row;
        for (uint32_t i = 0; i < model.particle_count(); ++i, xyz += 3) {
          const Eigen::Vector3d p(xyz[0], xyz[1], xyz[2]);
          const double distance_sq = (p - place_m).squaredNorm();
          const bool is_nearer = nearest ? distance_sq < least_sq : distance_sq <= least_sq;
          if (!is_nearer || model.inverse_masses_per_kg()[i] == 0 || grips.Holds(i)) continue;
          nearest = i;
          least_sq = distance_sq;
        }
        return nearest;
      },
      positions_m);
}

}  // namespace drape
