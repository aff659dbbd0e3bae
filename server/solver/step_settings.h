// How a step is computed: one algorithm, few switches, and presets that set them. All settings are
// rows of one table, kSettings: to add one, add its field to drape.v1.StepSettings, a member and a
// row here, and its use.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "server/core/status.h"
#include "server/core/violations.h"
#include "server/scene/scene_model.h"

namespace drape {

enum class Preset { kPaper, kRealtime, kAccurate };

// kInForce: spring forces are constant over the substep (paper equations 1 and 2; multiplies a
// spring's amplitude by sqrt(1 + h^2 w^2 / 2) each substep). kHalfKicks: velocity-Verlet.
enum class SpringIntegration { kInForce, kHalfKicks };

// How positions and velocities advance over a substep (server/solver/method.md, "Substeps").
// kOneStep: ballistic (paper equations 1 and 2), first order where impulses act. kTwoStep: the
// backward differentiation formula of second order. It restarts with every step, so a step is a
// function of positions and velocities. Cloths that it does not suit use kOneStep (step_plan.h).
enum class Integration { kOneStep, kTwoStep };

// In which order the distance constraints are solved within a sweep. kColours: Algorithm 1 of the
// paper. kStrips: whole paths at once (scene/strips.h), each as one tridiagonal system (the paper's
// reference [14]).
enum class Sweep { kColours, kStrips };

// Along which direction of a link its impulses act, with kOneStep (two steps: always kAtEnd).
// kAtEnd: as predicted for the end of the substep (the paper): first order, takes energy, stable at
// any step. kAtStart: as it was at its start (SHAKE): second order, keeps energy, unstable where
// h^2 T / (m L) exceeds about 1. kBlended: one of them or a mean, the same for all links of the
// cloth, chosen by that number for the cloth's weight (server/solver/method.md, "Direction").
enum class Direction { kAtEnd, kAtStart, kBlended };

// What of a cloth touches colliders (server/solver/method.md, "Edges and triangles"). kParticles:
// its particles, so that the middle of an edge of length l sinks l^2/8R into a ball. kSurface: the
// insides of its edges and triangles, too. kAuto: these where a collider moves and edges could be
// caught by it (collider_contact.h).
enum class ColliderContact { kParticles, kSurface, kAuto };

// Fully resolved settings of one cloth. Ranges, units and defaults stand in kSettings.
struct StepSettings {
  // The settings of the preset REALTIME.
  StepSettings();

  Preset preset{};
  double time_step_s{};
  uint32_t substeps{};
  uint32_t max_iterations{};  // sweeps per substep
  // Largest accepted |C| / rest length (contacts: / model length scale). 0 = a fixed number of
  // sweeps.
  double tolerance{};
  SpringIntegration spring_integration{};
  Integration integration{};
  Direction direction{};
  // Sweeps per substep that remove the velocities that constraints forbid; kOneStep only.
  uint32_t velocity_iterations{};
  Sweep sweep{};
  ColliderContact collider_contact{};
  // Rate at which the twist of a grid's cells is damped (server/solver/method.md, "damp_twist"). 0
  // = none.
  double twist_damping_per_s{};
  // The last sweep of a step leaves some links farther than this share of their length from it.
  // They are moved to it with their neighbours, round after round, within limits
  // (server/solver/method.md, "refine"). 0 = never.
  double refine_above_strain{};
  // Wall time that a step should take at most; 0 = no limit. The scheduler turns it into
  // StepItem::max_iterations (server/scheduler/frame_budget.h).
  double frame_budget_ms{};
  // A cloth sleeps once no particle has moved farther than this for sleep_after_s of simulated time
  // (server/scheduler/sleep_watch.h). Its steps are then complete without being computed, until
  // something acts on it. 0 = never.
  double sleep_motion_m{};
  double sleep_after_s{};
  // A cloth whose load (LoadRatio) is larger has more substeps, up to kMaxLoadFactor times as many:
  // see RaiseSubsteps (load.h). 0 = never.
  double load_limit{};
  // Whether particles are kept within reach of their pins (scene/tethers.h) before the sweeps.
  bool use_tethers{};

  double substep_s() const { return time_step_s / substeps; }
  friend bool operator==(const StepSettings&, const StepSettings&) = default;
};

inline constexpr uint32_t kMaxSubsteps = 10000;
inline constexpr uint32_t kMaxIterations = 10000;
// Below, h^2 and the velocities that follow from rounded positions lose their meaning in single
// precision.
inline constexpr double kMinSubstep_s = 1e-6;
// Largest SolvesPerStep of one cloth: a step cannot be interrupted, and all sessions wait for it.
inline constexpr double kMaxSolvesPerStep = 2e10;

// The reader of a setting.
enum class SettingReader {
  kServer,     // before a backend gets the cloth: ResolveSettings, RaiseSubsteps
  kStages,     // the stages of a step, in every backend
  kScheduler,  // around the steps; backends do not know it
};

// One row of kSettings. `Value` is double or uint32_t, bool, or an enum.
template <class Value>
struct Setting {
  std::string_view name;  // of the field of drape.v1.StepSettings
  Value StepSettings::*member;
  std::array<Value, 3> defaults;                    // in the order of Preset
  Range range{};                                    // of numbers
  std::span<const std::string_view> value_names{};  // of enums, in their order
  SettingReader reader = SettingReader::kStages;
};

template <class Value>
constexpr Setting<Value> Number(std::string_view name, Value StepSettings::*member,
                                std::type_identity_t<std::array<Value, 3>> defaults,
                                const Range& range, SettingReader reader = SettingReader::kStages) {
  return {name, member, defaults, range, {}, reader};
}
constexpr Setting<bool> Switch(std::string_view name, bool StepSettings::*member,
                               std::array<bool, 3> defaults) {
  return {name, member, defaults};
}
template <class Value>
constexpr Setting<Value> Choice(std::string_view name, Value StepSettings::*member,
                                std::type_identity_t<std::array<Value, 3>> defaults,
                                std::span<const std::string_view> value_names,
                                SettingReader reader = SettingReader::kStages) {
  return {name, member, defaults, {}, value_names, reader};
}

// The protocol's names, in the order of the enums.
inline constexpr std::array<std::string_view, 3> kPresetNames{"PAPER", "REALTIME", "ACCURATE"};
inline constexpr std::array<std::string_view, 2> kSpringIntegrationNames{"IN_FORCE", "HALF_KICKS"};
inline constexpr std::array<std::string_view, 2> kIntegrationNames{"ONE_STEP", "TWO_STEP"};
inline constexpr std::array<std::string_view, 2> kSweepNames{"COLOURS", "STRIPS"};
inline constexpr std::array<std::string_view, 3> kDirectionNames{"AT_END", "AT_START", "BLENDED"};
inline constexpr std::array<std::string_view, 3> kColliderContactNames{"PARTICLES", "SURFACE",
                                                                       "AUTO"};

// The table: name, member, the defaults of PAPER, REALTIME and ACCURATE, the legal values.
inline constexpr std::tuple kSettings{
    Choice("preset", &StepSettings::preset, {Preset::kPaper, Preset::kRealtime, Preset::kAccurate},
           kPresetNames, SettingReader::kServer),
    Number("time_step_s", &StepSettings::time_step_s, {1.0 / 60, 1.0 / 60, 1.0 / 60},
           Positive(10, "s")),
    Number("substeps", &StepSettings::substeps, {1, 52, 60}, {1, kMaxSubsteps}),
    Number("max_iterations", &StepSettings::max_iterations, {100, 1, 100}, {1, kMaxIterations}),
    Number("tolerance", &StepSettings::tolerance, {1e-3, 0, 1e-6}, FromZeroBelow(1)),
    Choice(
        "spring_integration", &StepSettings::spring_integration,
        {SpringIntegration::kInForce, SpringIntegration::kHalfKicks, SpringIntegration::kHalfKicks},
        kSpringIntegrationNames),
    Choice("integration", &StepSettings::integration,
           {Integration::kOneStep, Integration::kTwoStep, Integration::kTwoStep},
           kIntegrationNames),
    Choice("direction", &StepSettings::direction,
           {Direction::kAtEnd, Direction::kBlended, Direction::kBlended}, kDirectionNames),
    Number("velocity_iterations", &StepSettings::velocity_iterations, {0, 0, 0},
           {0, kMaxIterations}),
    Choice("sweep", &StepSettings::sweep, {Sweep::kColours, Sweep::kStrips, Sweep::kStrips},
           kSweepNames),
    Choice("collider_contact", &StepSettings::collider_contact,
           {ColliderContact::kParticles, ColliderContact::kAuto, ColliderContact::kAuto},
           kColliderContactNames),
    Switch("use_tethers", &StepSettings::use_tethers, {false, true, false}),
    Number("twist_damping_per_s", &StepSettings::twist_damping_per_s, {0, 150, 0}, {0, 1e6, "1/s"}),
    Number("refine_above_strain", &StepSettings::refine_above_strain, {0, 2e-3, 0},
           FromZeroBelow(1)),
    Number("load_limit", &StepSettings::load_limit, {0, 0.15, 0}, {0, 1e6}, SettingReader::kServer),
    Number("frame_budget_ms", &StepSettings::frame_budget_ms, {0, 0, 0}, {0, 10000, "ms"},
           SettingReader::kScheduler),
    Number("sleep_motion_m", &StepSettings::sleep_motion_m, {0, 1e-5, 0}, {0, 1, "m"},
           SettingReader::kScheduler),
    Number("sleep_after_s", &StepSettings::sleep_after_s, {1, 1, 1}, {0.1, 3600, "s"},
           SettingReader::kScheduler),
};

// Calls `visit` with every row.
template <class Visit>
constexpr void ForEachSetting(Visit&& visit) {
  std::apply([&](const auto&... rows) { (visit(rows), ...); }, kSettings);
}

// The defaults of a preset.
StepSettings PresetSettings(Preset preset);
std::string_view PresetName(Preset preset);

// The settings that a client set; the others have the default of the preset.
class StepSettingsOverrides {
 public:
  template <class Value>
  StepSettingsOverrides& Set(Value StepSettings::*member, std::type_identity_t<Value> value) {
    values_.*member = value;
    is_set_.set(RowOf(member));
    return *this;
  }
  template <class Value>
  bool IsSet(Value StepSettings::*member) const {
    return is_set_.test(RowOf(member));
  }
  // Members that are not set have REALTIME's values.
  const StepSettings& values() const { return values_; }

 private:
  template <class Value>
  static constexpr size_t RowOf(Value StepSettings::*member) {
    size_t row = 0;
    size_t found = kRowCount;
    ForEachSetting([&](const auto& setting) {
      if constexpr (std::is_same_v<decltype(setting.member), Value StepSettings::*>) {
        if (setting.member == member) found = row;
      }
      ++row;
    });
    return found;
  }

  static constexpr size_t kRowCount = std::tuple_size_v<decltype(kSettings)>;
  StepSettings values_;
  std::bitset<kRowCount> is_set_;
};

// The preset with the overrides, every range checked; violations are below `path`. If `substeps` is
// set and `load_limit` is not, `load_limit` is 0.
Result<StepSettings> ResolveSettings(const StepSettingsOverrides& overrides, const FieldPath& path);

// Upper bound on the solves of one step; proto/errors.md has the formula. Constraints that the
// model has left out count, as other pins may bring them back; so do triangles without air forces,
// because these may begin while the cloth runs.
double SolvesPerStep(const SceneModel& model, const StepSettings& settings, size_t collider_count);

// Largest number of particles * colliders of one cloth: each pair has impulses of its own during a
// step. With more, one cloth could take gigabytes.
inline constexpr uint64_t kMaxParticleColliderPairs = uint64_t{1} << 24;

}  // namespace drape
