// What the grips of one cloth hold over time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/scene/scene_model.h"
#include "server/scheduler/motion.h"
#include "server/solver/backend.h"
#include "server/solver/step_impulses.h"

namespace drape {

// The slots of one cloth, in the cloth frame. A grip is at a place that requests give; what it
// holds keeps the offset that it had when it was grabbed. Not thread-safe.
class GripTrack {
 public:
  struct Slot {
    std::optional<uint32_t> particle{};
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
    // Of the particle.
    Motion<Eigen::Vector3d> motion{Eigen::Vector3d::Zero(), std::nullopt, 0, 0};
    double largest_force_n = kNoLimit_n;
  };
  static constexpr double kNoLimit_n = std::numeric_limits<double>::infinity();

  // All open.
  void Start(uint32_t slot_count) { slots_.assign(slot_count, {}); }
  // All open again.
  void Reset();

  uint64_t held_bytes() const { return slots_.size() * (sizeof(Slot) + sizeof(Grip)); }
  uint32_t slot_count() const { return static_cast<uint32_t>(slots_.size()); }
  std::optional<uint32_t> particle(uint32_t slot) const { return At(slot).particle; }
  bool Holds(uint32_t particle) const;
  // Of what the slot holds (not open); where it is at `time_s`.
  Eigen::Vector3d PositionAt(uint32_t slot, double time_s) const;

  // The grip is at `place_m`, and what it grabs stays where it is. A slot that held the particle
  // opens; so does this one first.
  void Grab(uint32_t slot, uint32_t particle, const Eigen::Vector3d& position_m,
            const Eigen::Vector3d& place_m, double now_s, double largest_force_n = kNoLimit_n);
  // What it holds leaves for `place_m` and its offset, over `over_s` seconds. Nothing if it is
  // open.
  void Hold(uint32_t slot, const Eigen::Vector3d& place_m, double over_s, double now_s);
  void Release(uint32_t slot);
  // Whether a force may open what is closed; then OpenOverloaded wants the impulses of each step.
  bool has_largest_forces() const;
  // Opens the slots that were pulled harder, on average over a step of this duration.
  void OpenOverloaded(const StepImpulses& impulses, double duration_s);
  // Slots that hold a pin of `model` open.
  void ReleasePins(const SceneModel& model);

  // As StepItem::grips wants them for a step that ends at `end_s`. Valid until the next call.
  std::span<const Grip> GripsForStep(double end_s);
  // Whether that step holds other particles than the one before, or moves one.
  bool has_changed() const { return has_changed_; }

  const std::vector<Slot>& slots() const { return slots_; }
  bool is_settled() const { return is_settled_; }
  // As a track with these slots was. What is held has a goal; `is_settled`: every motion is over,
  // and the backend has been told.
  void Restore(std::vector<Slot> slots, bool is_settled);

 private:
  const Slot& At(uint32_t slot) const;
  Slot& At(uint32_t slot) { return const_cast<Slot&>(std::as_const(*this).At(slot)); }

  std::vector<Slot> slots_;
  std::vector<Grip> grips_;
  bool is_settled_ = true;  // every motion is over and the backend has been told
  bool has_changed_ = false;
};

// The particle nearest to `place_m` within `radius_m` that is no pin of `model` and in no slot of
// `grips`; of several the one with the smallest index. `positions_m`: rows of a column from
// `first_row` on.
std::optional<uint32_t> NearestLoose(const SceneModel& model, const GripTrack& grips,
                                     const ScalarColumn& positions_m, size_t first_row,
                                     const Eigen::Vector3d& place_m, double radius_m);

}  // namespace drape
