// The stages of a step, in order. One name each: the enum value, the function of each CPU backend,
// the GLSL function or kernel and the heading of server/solver/method.md are the same word.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace drape {

// apply_springs     half a kick of the spring accelerations (HALF_KICKS only)
// apply_elastic     half a kick of the elements of bending and shear
// apply_wind        half a kick of the air's drag and lift on the triangles
// for each substep of size h:
//   predict         u = v + a h/2, the mean velocity over the substep; pins: (target - p) / h
//   solve_elastic   elements of bending and shear of grids, line by line, in place of kicks
//   solve_hinges    hinges of meshes too stiff for kicks, in a few stages
//   damp_twist      every few substeps: the cells of a grid lose twist
//   tether          no particle farther from its pins than the cloth between them allows
//   find_self_contacts   the pairs of vertices, edges and triangles of the cloth that may touch
//   until no error exceeds the tolerance, at most max_iterations times:
//     solve_strips    per phase of strips: the impulses that remove the errors of a whole path
//     refine          moves the links that the strips left stretched, with their neighbours
//     solve_distance  per colour: the impulse that removes each constraint's error at p + h u
//     solve_joints    per colour of the joints: the impulse that closes each point joint
//     solve_self_contacts  per pair: distance >= thickness at p + h u, Coulomb friction
//     solve_contacts  per particle: gap >= 0 at p + h u, Coulomb friction against h u
//   integrate       p += h u, v = u + a h/2
//   guard_self_contacts  no pair passes through itself; what touches loses its approach velocity
//   solve_velocity  per colour, velocity_iterations times: no velocity along rigid links and joints
//   correct_velocity  contacts: no approach velocity, Coulomb friction; then damping
//   apply_springs, apply_elastic, apply_wind: a full kick, half a kick after the last substep
// commit            the new state replaces the old one, unless the cloth is faulted
// measure           the quantities that a report asks for, from the committed state
enum class StepStage : uint8_t {
  kApplySprings,
  kApplyElastic,
  kApplyWind,
  kPredict,
  kSolveElastic,
  kSolveHinges,
  kDampTwist,
  kTether,
  kFindSelfContacts,
  kSolveStrips,
  kRefine,
  kSolveDistance,
  kSolveJoints,
  kSolveSelfContacts,
  kSolveContacts,
  kIntegrate,
  kGuardSelfContacts,
  kSolveVelocity,
  kCorrectVelocity,
  kCommit,
  kMeasure,
};

// [StepStage], in the order above.
inline constexpr std::array<std::string_view, 21> kStageNames = {
    "apply_springs",
    "apply_elastic",
    "apply_wind",
    "predict",
    "solve_elastic",
    "solve_hinges",
    "damp_twist",
    "tether",
    "find_self_contacts",
    "solve_strips",
    "refine",
    "solve_distance",
    "solve_joints",
    "solve_self_contacts",
    "solve_contacts",
    "integrate",
    "guard_self_contacts",
    "solve_velocity",
    "correct_velocity",
    "commit",
    "measure",
};
static_assert(static_cast<size_t>(StepStage::kMeasure) + 1 == kStageNames.size());

constexpr std::string_view StageName(StepStage stage) {
  return kStageNames[static_cast<size_t>(stage)];
}

// A set of stages. A value: comparable, small, cheap to copy.
class StageSet {
 public:
  constexpr StageSet() = default;
  constexpr StageSet(std::initializer_list<StepStage> stages) {
    for (const StepStage stage : stages) Add(stage);
  }

  constexpr bool Has(StepStage stage) const { return (bits_ & BitOf(stage)) != 0; }
  constexpr bool HasAnyOf(StageSet stages) const { return (bits_ & stages.bits_) != 0; }
  constexpr void Add(StepStage stage, bool condition = true) {
    if (condition) bits_ |= BitOf(stage);
  }

  friend constexpr auto operator<=>(const StageSet&, const StageSet&) = default;

 private:
  static constexpr uint32_t BitOf(StepStage stage) { return 1u << static_cast<uint32_t>(stage); }

  uint32_t bits_ = 0;
};

}  // namespace drape
