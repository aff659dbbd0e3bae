#include "server/solver/step_settings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "server/solver/solver_constants.h"

namespace drape {

namespace {

// As short as it can be said: 1e-30, not 0.000000.
std::string Text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

// 4 ulp: two positions, each rounded when stored, and their difference.
double ResolvableTolerance(double tolerance, const SceneModel& model, double relative_ulp) {
  if (tolerance <= 0) return 0;
  return std::max(tolerance, 4 * relative_ulp * model.resolution_ratio());
}

}  // namespace

StepSettings PresetSettings(Preset preset) {
  StepSettings settings;
  settings.preset = preset;
  switch (preset) {
    case Preset::kPaper:
      settings.substeps = 1;
      settings.max_iterations = 100;
      settings.tolerance = 1e-3;
      settings.spring_integration = SpringIntegration::kInForce;
      settings.use_tethers = false;
      settings.integration = Integration::kOneStep;
      settings.direction = Direction::kAtEnd;
      settings.sweep = Sweep::kColours;
      break;
    case Preset::kRealtime:
      settings.substeps = 52;
      settings.max_iterations = 1;
      settings.tolerance = 0;
      settings.twist_damping_per_s = 150;
      settings.load_limit = 0.15;
      settings.sleep_motion_m = 1e-5;
      settings.refine_above_strain = 2e-3;
      break;
    case Preset::kAccurate:
      settings.substeps = 60;
      settings.max_iterations = 100;
      settings.tolerance = 1e-6;
      settings.use_tethers = false;
      break;
  }
  return settings;
}

std::string_view PresetName(Preset preset) {
  switch (preset) {
    case Preset::kPaper:
      return "PAPER";
    case Preset::kRealtime:
      return "REALTIME";
    case Preset::kAccurate:
      return "ACCURATE";
  }
  return "";
}

Result<StepSettings> ResolveSettings(const StepSettingsOverrides& overrides,
                                     std::string_view field_prefix) {
  StepSettings settings = PresetSettings(overrides.preset.value_or(Preset::kRealtime));
  if (overrides.time_step_s) settings.time_step_s = *overrides.time_step_s;
  if (overrides.substeps) {
    settings.substeps = *overrides.substeps;
    settings.load_limit = 0;
  }
  if (overrides.load_limit) settings.load_limit = *overrides.load_limit;
  if (overrides.max_iterations) settings.max_iterations = *overrides.max_iterations;
  if (overrides.tolerance) settings.tolerance = *overrides.tolerance;
  if (overrides.use_tethers) settings.use_tethers = *overrides.use_tethers;
  if (overrides.integration) settings.integration = *overrides.integration;
  if (overrides.direction) settings.direction = *overrides.direction;
  if (overrides.velocity_iterations) settings.velocity_iterations = *overrides.velocity_iterations;
  if (overrides.sweep) settings.sweep = *overrides.sweep;
  if (overrides.twist_damping_per_s) settings.twist_damping_per_s = *overrides.twist_damping_per_s;
  if (overrides.refine_above_strain) settings.refine_above_strain = *overrides.refine_above_strain;
  if (overrides.sleep_motion_m) settings.sleep_motion_m = *overrides.sleep_motion_m;
  if (overrides.frame_budget_ms) settings.frame_budget_ms = *overrides.frame_budget_ms;
  if (overrides.spring_integration) settings.spring_integration = *overrides.spring_integration;

  std::vector<FieldViolation> violations;
  const auto check = [&](bool is_legal, const char* field, double value, const std::string& range) {
    if (is_legal) return;
    violations.push_back(
        {std::string(field_prefix) + "." + field, Text(value) + " is not in " + range});
  };
  check(settings.time_step_s > 0 && settings.time_step_s <= kMaxTimeStep_s, "time_step_s",
        settings.time_step_s, "(0, 10] s");
  check(settings.substeps >= 1 && settings.substeps <= kMaxSubsteps, "substeps", settings.substeps,
        "[1, " + std::to_string(kMaxSubsteps) + "]");
  check(settings.max_iterations >= 1 && settings.max_iterations <= kMaxIterations, "max_iterations",
        settings.max_iterations, "[1, " + std::to_string(kMaxIterations) + "]");
  check(settings.velocity_iterations <= kMaxIterations, "velocity_iterations",
        settings.velocity_iterations, "[0, " + std::to_string(kMaxIterations) + "]");
  check(settings.tolerance >= 0 && settings.tolerance < 1, "tolerance", settings.tolerance,
        "[0, 1)");
  check(settings.twist_damping_per_s >= 0 && settings.twist_damping_per_s <= kMaxTwistDamping_per_s,
        "twist_damping_per_s", settings.twist_damping_per_s, "[0, 1e+06] 1/s");
  check(settings.refine_above_strain >= 0 && settings.refine_above_strain < 1,
        "refine_above_strain", settings.refine_above_strain, "[0, 1)");
  check(settings.frame_budget_ms >= 0 && settings.frame_budget_ms <= kMaxFrameBudget_ms,
        "frame_budget_ms", settings.frame_budget_ms, "[0, 10000] ms");
  check(settings.load_limit >= 0 && settings.load_limit <= kMaxLoadLimit, "load_limit",
        settings.load_limit, "[0, 1e+06]");
  check(settings.sleep_motion_m >= 0 && settings.sleep_motion_m <= kMaxSleepMotion_m,
        "sleep_motion_m", settings.sleep_motion_m, "[0, 1] m");
  if (violations.empty() && settings.substep_s() < kMinSubstep_s) {
    violations.push_back({std::string(field_prefix) + ".time_step_s",
                          Text(settings.time_step_s) + " s in " + Text(settings.substeps) +
                              " substeps makes a substep below 1e-6 s"});
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return settings;
}

double SolvesPerStep(const SceneModel& model, const StepSettings& settings, size_t collider_count) {
  const double sweeps = double{1} * settings.substeps * settings.max_iterations;
  const double constraints =
      double{1} * model.constraint_count() + model.dropped_constraints() + model.joint_count();
  const double velocity_sweeps = double{1} * settings.substeps * settings.velocity_iterations;
  const double velocities = velocity_sweeps * (double{1} * model.constraint_count() +
                                               model.dropped_constraints() + model.joint_count());
  const double contacts = model.particle_count() * (1 + static_cast<double>(collider_count));
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

bool HasTethers(const SceneModel& model, const StepSettings& settings) {
  return settings.use_tethers && !model.tethers().empty();
}

double SinglePrecisionTolerance(double tolerance, const SceneModel& model) {
  return ResolvableTolerance(tolerance, model, std::numeric_limits<float>::epsilon());
}

double DoublePrecisionTolerance(double tolerance, const SceneModel& model) {
  return ResolvableTolerance(tolerance, model, std::numeric_limits<double>::epsilon());
}

}  // namespace drape
