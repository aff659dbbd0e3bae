// How a step is computed: one algorithm, few switches, and presets that set them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "server/core/status.h"
#include "server/scene/scene_model.h"

namespace drape {

enum class Preset { kPaper, kRealtime, kAccurate };

// kInForce: spring forces are constant over the substep (paper equations 1 and 2; multiplies a
// spring's amplitude by sqrt(1 + h^2 w^2 / 2) each substep). kHalfKicks: velocity-Verlet.
enum class SpringIntegration { kInForce, kHalfKicks };

// How positions and velocities advance over a substep (server/solver/method.md, "Substeps").
// kOneStep: ballistic (paper equations 1 and 2), first order where impulses act. kTwoStep: the
// backward differentiation formula of second order. It starts anew with every step, so a step is a
// function of positions and velocities. Cloths that it does not suit use kOneStep (step_plan.h).
enum class Integration { kOneStep, kTwoStep };

// In which order the distance constraints are solved within a sweep. kColours: Algorithm 1 of the
// paper. kStrips: whole paths at once (scene/strips.h), each as one tridiagonal system (the paper's
// reference [14]).
enum class Sweep { kColours, kStrips };

// Along which direction of a link its impulses act, with kOneStep (two steps: always kAtEnd).
// kAtEnd: as predicted for the end of the substep (the paper): first order, takes energy, stable at
// any step. kAtStart: as it was at its start (SHAKE): second order, keeps energy, unstable where
// h^2 T / (m L) exceeds about 1. kBlended: one of them or a mean, for all links of the cloth alike,
// by that number for the cloth's weight (server/solver/method.md, "Direction").
enum class Direction { kAtEnd, kAtStart, kBlended };

// Fully resolved settings of one cloth.
struct StepSettings {
  Preset preset = Preset::kRealtime;
  double time_step_s = 1.0 / 60;  // (0, kMaxTimeStep_s]
  uint32_t substeps = 60;         // [1, kMaxSubsteps]
  uint32_t max_iterations = 1;    // [1, kMaxIterations] sweeps per substep
  // Largest accepted |C| / rest length (contacts: / model length scale). 0 = a fixed number of
  // sweeps.
  double tolerance = 0;  // [0, 1)
  SpringIntegration spring_integration = SpringIntegration::kHalfKicks;
  Integration integration = Integration::kTwoStep;
  Direction direction = Direction::kBlended;
  // [0, kMaxIterations] sweeps per substep that take the velocities along links which the
  // constraints forbid; kOneStep only.
  uint32_t velocity_iterations = 0;
  Sweep sweep = Sweep::kStrips;
  // Rate at which the twist of a grid's cells is damped [1/s], see server/solver/method.md; 0 =
  // none.
  double twist_damping_per_s = 0;
  // Links that the strips of a step's last sweep leave farther than this share of their length from
  // it are moved to it, with their neighbours, until none is so far off, within limits
  // (server/solver/method.md, "refine"). [0, 1); 0 = never.
  double refine_above_strain = 0;
  // Wall time that a step should take at most [ms], [0, kMaxFrameBudget_ms]; 0 = none. Backends do
  // not know it: the scheduler turns it into StepItem::max_iterations
  // (server/scheduler/frame_budget.h).
  double frame_budget_ms = 0;
  // A cloth of which no particle gets farther than this from where it was [m], within a second of
  // simulated time, sleeps: its steps are complete without being computed, until something acts on
  // it. [0, kMaxSleepMotion_m]; 0 = never. Backends do not know it
  // (server/scheduler/sleep_watch.h).
  double sleep_motion_m = 0;
  // Where the load of a cloth (LoadRatio) is larger, it has more substeps than `substeps`, up to
  // kMaxLoadFactor times as many: [0, kMaxLoadLimit]; 0 = never. Backends do not know it: see
  // RaiseSubsteps in load.h.
  double load_limit = 0;
  // Whether particles are kept within reach of their pins (scene/tethers.h) before the sweeps.
  bool use_tethers = true;

  double substep_s() const { return time_step_s / substeps; }
  friend bool operator==(const StepSettings&, const StepSettings&) = default;
};

// What a client asked for; unset = the preset's value.
struct StepSettingsOverrides {
  std::optional<Preset> preset{};  // default kRealtime
  std::optional<double> time_step_s{};
  std::optional<uint32_t> substeps{};
  std::optional<uint32_t> max_iterations{};
  std::optional<double> tolerance{};
  std::optional<SpringIntegration> spring_integration{};
  std::optional<bool> use_tethers{};
  std::optional<Integration> integration{};
  std::optional<Direction> direction{};
  std::optional<uint32_t> velocity_iterations{};
  std::optional<Sweep> sweep{};
  std::optional<double> twist_damping_per_s{};
  std::optional<double> refine_above_strain{};
  std::optional<double> frame_budget_ms{};
  // Default 0 where `substeps` is set, else the preset's.
  std::optional<double> load_limit{};
  std::optional<double> sleep_motion_m{};
};

inline constexpr double kMaxTimeStep_s = 10;
inline constexpr double kMaxTwistDamping_per_s = 1e6;
inline constexpr double kMaxFrameBudget_ms = 10000;
inline constexpr double kMaxLoadLimit = 1e6;
inline constexpr double kMaxSleepMotion_m = 1;
// Below, h^2 and the velocities that follow from rounded positions lose their meaning in single
// precision.
inline constexpr double kMinSubstep_s = 1e-6;
inline constexpr uint32_t kMaxSubsteps = 10000;
inline constexpr uint32_t kMaxIterations = 10000;
// Of one cloth, see SolvesPerStep: a step cannot be interrupted, and all tenants wait for it.
inline constexpr double kMaxSolvesPerStep = 2e10;

// The table of presets.
StepSettings PresetSettings(Preset preset);
std::string_view PresetName(Preset preset);

// Preset plus overrides, every range checked; violations name "<field_prefix>.substeps" and so on.
Result<StepSettings> ResolveSettings(const StepSettingsOverrides& overrides,
                                     std::string_view field_prefix);

// Upper bound on the solves of one step: substeps * (max_iterations * (constraints + joints + 2 *
// springs + particles * (1 + colliders)) + 2 * triangles + 4 * particles), the last with tethers
// only; with refinement its sweeps over all constraints. Constraints that the model has left out
// count, other pins may bring them back; so do triangles without air forces, which may come while
// the cloth runs.
double SolvesPerStep(const SceneModel& model, const StepSettings& settings, size_t collider_count);

// Whether the stage `tether` has anything to do.
bool HasTethers(const SceneModel& model, const StepSettings& settings);

// Below about 4 ulp(|p|) / rest length no sweep in single precision ever meets the tolerance.
// Returns the tolerance to use: the one asked for, or the smallest that 24-bit positions of this
// size can resolve. 0 stays 0.
double SinglePrecisionTolerance(double tolerance, const SceneModel& model);
// The same for 53-bit positions.
double DoublePrecisionTolerance(double tolerance, const SceneModel& model);

// Of one cloth, particles * colliders: each pair has impulses of its own during a step. More would
// let one cloth take gigabytes.
inline constexpr uint64_t kMaxParticleColliderPairs = uint64_t{1} << 24;

}  // namespace drape
