// The controls of a step request: plain values.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/collider_track.h"

namespace drape {

// Every control takes effect at the start of the first step of its request. `over_s` >= 0; 0 =
// within one step.

// Moves a pin.
struct PinControl {
  uint32_t particle = 0;  // must be pinned when the request starts
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();
  double over_s = 0;
};

// Moves a collider.
struct ColliderControl {
  uint32_t collider = 0;  // the cloth must have it when the request starts
  ColliderTarget target{};
  double over_s = 0;
};

// Drives a rest length.
struct LengthControl {
  // In the order of the description; must be in the model when the request starts.
  uint32_t constraint = 0;
  double length_m = 0;  // > 0
  double over_s = 0;
};

// Drives every rest length of a cloth to that of its model times `scale`.
struct LengthScale {
  double scale = 1;  // > 0
  double over_s = 0;
};

enum class GripAction {
  kHold,          // the grip moves to `place_m`, with what it holds
  kGrabParticle,  // the grip is at `place_m` and grabs `particle`, which must not be pinned
  kGrabNearest,   // the same with the nearest particle that is free within `radius_m`, if any
  kRelease,
};

// Limit on GripControl::largest_force_n that is one [N].
inline constexpr double kMaxGripForce_n = 1e9;

// Moves, closes or opens a grip. Several of one slot act one after the other.
struct GripControl {
  uint32_t slot = 0;  // below max_grips of the cloth
  GripAction action = GripAction::kHold;
  uint32_t particle = 0;
  double radius_m = 0;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
  double over_s = 0;  // of kHold
  // Of what grabs: above it the grip opens [N].
  double largest_force_n = std::numeric_limits<double>::infinity();
};

// A control and its cloth, as an index into StepWork::cloths. Cloth frame.
template <class Control>
struct ClothControl {
  uint32_t cloth_index = 0;
  Control control;
};

struct StepControls {
  std::vector<ClothControl<PinControl>> pins;
  std::vector<ClothControl<ColliderControl>> colliders;
  std::vector<ClothControl<LengthScale>> length_scales;  // before the single lengths
  std::vector<ClothControl<LengthControl>> lengths;
  std::vector<ClothControl<GripControl>> grips;

  // Calls `function` with every ClothControl but grips, in the order in which they take effect,
  // until it returns an error.
  template <class Function>
  Status ForEach(Function function) const {
    const auto for_all = [&](const auto& controls) -> Status {
      for (const auto& control : controls) DRAPE_RETURN_IF_ERROR(function(control));
      return Status::Ok();
    };
    DRAPE_RETURN_IF_ERROR(for_all(pins));
    DRAPE_RETURN_IF_ERROR(for_all(colliders));
    DRAPE_RETURN_IF_ERROR(for_all(length_scales));
    return for_all(lengths);
  }
};

}  // namespace drape
