#include "server/solver/step_settings.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "server/solver/solver_constants.h"

namespace drape {

namespace {

// A triangle and half of each of its edges.
constexpr double kSurfacePartsPerTriangle = 2.5;

void SetDefaults(Preset preset, StepSettings& settings) {
  ForEachSetting([&](const auto& setting) {
    settings.*setting.member = setting.defaults[static_cast<size_t>(preset)];
  });
}

void CheckRange(const FieldPath& path, double value, const Range& range, Violations& violations) {
  violations.InRange(path, value, range);
}

void CheckRange(const FieldPath& path, uint32_t value, const Range& range, Violations& violations) {
  violations.CountInRange(path, value, static_cast<uint64_t>(range.low),
                          static_cast<uint64_t>(range.high));
}

// Switches and choices have no range.
template <class Value>
void CheckRange(const FieldPath&, Value, const Range&, Violations&) {}

}  // namespace

StepSettings::StepSettings() {
  SetDefaults(Preset::kRealtime, *this);
}

StepSettings PresetSettings(Preset preset) {
  StepSettings settings;
  SetDefaults(preset, settings);
  return settings;
}

std::string_view PresetName(Preset preset) {
  return kPresetNames[static_cast<size_t>(preset)];
}

Result<StepSettings> ResolveSettings(const StepSettingsOverrides& overrides,
                                     const FieldPath& path) {
  StepSettings settings = PresetSettings(overrides.values().preset);
  if (overrides.IsSet(&StepSettings::substeps)) settings.load_limit = 0;
  Violations violations;
  ForEachSetting([&](const auto& setting) {
    if (!overrides.IsSet(setting.member)) return;
    settings.*setting.member = overrides.values().*setting.member;
    CheckRange(path.Child(setting.name), settings.*setting.member, setting.range, violations);
  });
  if (violations.is_empty() && settings.substep_s() < kMinSubstep_s) {
    violations.Add(path.Child("time_step_s"),
                   NumberText(settings.time_step_s) + " s in " + std::to_string(settings.substeps) +
                       " substeps makes a substep below " + NumberText(kMinSubstep_s) + " s");
  }
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return settings;
}

double SolvesPerStep(const SceneModel& model, const StepSettings& settings, size_t collider_count) {
  const double sweeps = double{1} * settings.substeps * settings.max_iterations;
  // Those on ways back are solved again.
  const double swept = static_cast<double>(
      std::max(size_t{model.constraint_count()}, model.strips().constraints.size()));
  const double constraints = swept + model.dropped_constraints() + model.joint_count();
  const double velocity_sweeps = double{1} * settings.substeps * settings.velocity_iterations;
  const double velocities = velocity_sweeps * (double{1} * model.constraint_count() +
                                               model.dropped_constraints() + model.joint_count());
  const double contacts =
      model.particle_count() * (1 + static_cast<double>(collider_count)) +
      (settings.collider_contact == ColliderContact::kSurface
           ? kSurfacePartsPerTriangle * static_cast<double>(model.triangles().size()) *
                 static_cast<double>(collider_count)
           : 0);
  const double tethers =
      settings.use_tethers ? double{1} * settings.substeps * model.particle_count() : 0;
  const double twist =
      settings.twist_damping_per_s > 0 ? 2.0 * settings.substeps * model.particle_count() : 0;
  const double air = 2.0 * settings.substeps * static_cast<double>(model.triangles().size());
  const double elastic = 2.0 * settings.substeps * model.elastic_count();
  const double refinement =
      settings.refine_above_strain > 0
          ? double{kMaxRefineRounds} * (1 + kRefineSweeps) * model.constraint_count()
          : 0;
  return sweeps * (constraints + 2.0 * model.spring_count() + contacts) +
         kMaxTethersPerParticle * tethers + velocities + twist + air + elastic + refinement;
}

}  // namespace drape
