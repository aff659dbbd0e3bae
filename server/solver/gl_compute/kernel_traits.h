// The traits that a kernel is compiled for: stages of the step, features that change their code,
// and the shapes of colliders.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "server/scene/colliders.h"
#include "server/solver/step_stage.h"

namespace drape {

enum class Feature : uint8_t {
  kSpringForces,  // springs act within the substep, not by kicks
  kCompliance,
  kInequalities,
  kOwnLengths,  // rest lengths in the parameters, not in the model
  kJointCompliance,
  kFriction,
  kTwoFrictions,  // a static one and a smaller dynamic one, with two steps
  kRestitution,
  kMovingColliders,
  kColliderReach,  // a step leaves out the colliders that the cloth cannot meet in it
  kDamping,
  kPins,
  kTolerance,
  kTwoSteps,
  kStartDirections,  // impulses not only along the directions at the end of the substep
  kRegularStrips,    // all strips are regular, and read without lists
  kSpansThatGive,    // strips between pins have larger diagonals
  kQuietLinks,
  kGrips,        // particles that are held for a while
  kEnergyWatch,  // a step that gains energy for no reason is found
  kRemainders,   // what rounding takes from positions is carried on
  kHingeAngles,  // hinges drawn at an angle: each has an impulse on each of its particles
  kImpulses,     // of a step that tells them; no bit of a state depends on it
};

// [Feature], in the order above.
inline constexpr std::array<std::string_view, 23> kFeatureNames = {
    "spring_forces",  "compliance",       "inequalities",
    "own_lengths",    "joint_compliance", "friction",
    "two_frictions",  "restitution",      "moving_colliders",
    "collider_reach", "damping",          "pins",
    "tolerance",      "two_steps",        "start_directions",
    "regular_strips", "spans_that_give",  "quiet_links",
    "grips",          "energy_watch",     "remainders",
    "hinge_angles",   "impulses",
};
static_assert(static_cast<size_t>(Feature::kImpulses) + 1 == kFeatureNames.size());

// Spheres and planes are cheap: kernels do not ask whether there are any.
constexpr bool IsInEveryKernel(ShapeKind shape) {
  return shape == ShapeKind::kSphere || shape == ShapeKind::kPlane;
}

// A stage, a feature or a shape, numbered in that order.
class KernelTrait {
 public:
  static constexpr uint32_t kFirstFeature = kStageNames.size();
  static constexpr uint32_t kFirstShape = kFirstFeature + kFeatureNames.size();
  static constexpr uint32_t kCount = kFirstShape + kShapeNames.size();

  // NOLINTBEGIN(google-explicit-constructor): lists name stages, features and shapes.
  constexpr KernelTrait(StepStage stage) : number_(static_cast<uint32_t>(stage)) {}
  constexpr KernelTrait(Feature feature)
      : number_(kFirstFeature + static_cast<uint32_t>(feature)) {}
  constexpr KernelTrait(ShapeKind shape) : number_(kFirstShape + static_cast<uint32_t>(shape)) {}
  // NOLINTEND(google-explicit-constructor)

  constexpr uint32_t number() const { return number_; }

 private:
  uint32_t number_;
};

class TraitSet {
 public:
  constexpr TraitSet() = default;
  constexpr TraitSet(std::initializer_list<KernelTrait> traits) {
    for (const KernelTrait trait : traits) Add(trait);
  }

  constexpr bool Has(KernelTrait trait) const { return (bits_ & BitOf(trait)) != 0; }
  constexpr bool HasAnyOf(TraitSet traits) const { return (bits_ & traits.bits_) != 0; }
  constexpr void Add(KernelTrait trait, bool condition = true) {
    if (condition) bits_ |= BitOf(trait);
  }
  constexpr void Add(StageSet stages) {
    for (uint32_t k = 0; k < kStageNames.size(); ++k) {
      const auto stage = static_cast<StepStage>(k);
      Add(stage, stages.Has(stage));
    }
  }
  // Every shape that kernels ask for.
  static constexpr TraitSet OfAllShapes() {
    TraitSet shapes;
    for (size_t k = 0; k < kShapeNames.size(); ++k) {
      const auto shape = static_cast<ShapeKind>(k);
      shapes.Add(shape, !IsInEveryKernel(shape));
    }
    return shapes;
  }
  // One `#define HAS_<NAME>` per trait.
  std::string Defines() const;

  friend constexpr TraitSet operator|(TraitSet a, TraitSet b) {
    return TraitSet(a.bits_ | b.bits_);
  }
  friend constexpr TraitSet operator&(TraitSet a, TraitSet b) {
    return TraitSet(a.bits_ & b.bits_);
  }
  friend constexpr auto operator<=>(const TraitSet&, const TraitSet&) = default;

 private:
  static_assert(KernelTrait::kCount <= 64);
  explicit constexpr TraitSet(uint64_t bits) : bits_(bits) {}
  static constexpr uint64_t BitOf(KernelTrait trait) { return uint64_t{1} << trait.number(); }

  uint64_t bits_ = 0;
};

// A name as constants of the shaders spell it: in upper case.
std::string UpperCase(std::string_view name);

// [KernelTrait::number], "HAS_SOLVE_STRIPS" and so on.
const std::array<std::string, KernelTrait::kCount>& TraitDefines();

}  // namespace drape
