#include "tests/stability/atlas/trial.h"
#include "server/solver/load.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <set>

#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Steps that are done again without a neighbour.
constexpr uint32_t kAloneSteps = 20;

size_t HashOf(Backend& backend, ClothHandle cloth) {
  return std::hash<std::string>()(ReadBits(backend, cloth));
}

// The error that a constraint of this kind forbids, as a share of its length.
double StrainOf(const DistanceConstraint& constraint, const ParticleState& state) {
  const Vector3d d = state.positions_m[constraint.j] - state.positions_m[constraint.i];
  const double strain = d.norm() / constraint.rest_length_m - 1;
  if (constraint.kind == ConstraintKind::kAtMost) return std::max(strain, 0.0);
  if (constraint.kind == ConstraintKind::kAtLeast) return std::max(-strain, 0.0);
  return std::abs(strain);
}

// Measures states in double precision, the same for every backend.
class Gauge {
 public:
  Gauge(const AtlasCase& atlas_case, const StepSettings& settings)
      : case_(atlas_case),
        model_(*atlas_case.scene.model),
        gravity_(atlas_case.scene.parameters.gravity_m_per_s2),
        lag_m_per_s_(gravity_.norm() * settings.substep_s() / 2) {
    double mass_kg = 0;
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      if (!IsPin(i)) mass_kg += model_.masses_kg()[i];
    }
    unit_j_ = mass_kg * std::max(gravity_.norm(), 9.81) * case_.length_m;
    start_j_ = Energy_j(case_.scene.state, 0);
  }

  // Above the least strain.
  double Strain(const ParticleState& state) const {
    double largest = 0;
    for (const DistanceConstraint& constraint : model_.constraints()) {
      largest = std::max(largest, StrainOf(constraint, state));
    }
    return std::max(largest - case_.least_strain, 0.0);
  }

  // The velocity of a particle that constraints hold is off by up to half a substep of gravity
  // (server/solver/method.md), so kinetic energy is counted without as much.
  double Gain(const ParticleState& state) const {
    return (Energy_j(state, lag_m_per_s_) - start_j_ - case_.allowed_gain_j) / unit_j_;
  }

 private:
  bool IsPin(uint32_t i) const { return model_.inverse_masses_per_kg()[i] == 0; }

  double Energy_j(const ParticleState& state, double lag_m_per_s) const {
    double energy_j = 0;
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      if (IsPin(i)) continue;
      const double speed = std::max(state.velocities_m_per_s[i].norm() - lag_m_per_s, 0.0);
      energy_j += model_.masses_kg()[i] * (speed * speed / 2 - gravity_.dot(state.positions_m[i]));
    }
    for (const Spring& spring : model_.springs()) {
      const double length_m = (state.positions_m[spring.j] - state.positions_m[spring.i]).norm();
      energy_j += spring.stiffness_n_per_m * std::pow(length_m - spring.rest_length_m, 2) / 2;
    }
    for (const DistanceConstraint& constraint : model_.constraints()) {
      if (constraint.compliance_m_per_n == 0) continue;
      const double error_m = StrainOf(constraint, state) * constraint.rest_length_m;
      energy_j += error_m * error_m / constraint.compliance_m_per_n / 2;
    }
    return energy_j;
  }

  const AtlasCase& case_;
  const SceneModel& model_;
  Vector3d gravity_;
  double lag_m_per_s_;
  double unit_j_ = 0;
  double start_j_ = 0;
};

uint32_t PlannedSteps(const AtlasCase& atlas_case, const StepSettings& settings,
                      const TrialLimits& limits) {
  if (limits.steps > 0) return limits.steps;
  if (atlas_case.substeps > 0) {
    return (atlas_case.substeps + settings.substeps - 1) / settings.substeps;
  }
  const double h = settings.time_step_s;
  if (atlas_case.duration_s > 0)
    return static_cast<uint32_t>(std::lround(atlas_case.duration_s / h));
  const double duration_s =
      std::min(limits.duration_s, std::max(limits.max_steps * h, limits.least_s));
  return static_cast<uint32_t>(std::lround(duration_s / h));
}

struct Warnings {
  std::set<std::string> names;

  void Add(const StepWarnings& warnings) {
    if (warnings.not_converged) names.insert("not_converged");
    if (warnings.springs_gain_energy) names.insert("springs_gain_energy");
    if (warnings.springs_beyond_limit) names.insert("springs_beyond_limit");
  }
  std::string Text() const {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
    return text;
  }
};

bool IsFinite(const Measurements& m) {
  const double values[] = {m.max_strain,         m.rms_strain,      m.kinetic_energy_j,
                           m.potential_energy_j, m.strain_energy_j, m.lowest_m,
                           m.max_penetration_m,  m.max_residual_m};
  return std::all_of(std::begin(values), std::end(values),
                     [](double v) { return std::isfinite(v); });
}

// A play of the case: its cloth, its pins, one step after the other.
class Play {
 public:
  Play(Backend& backend, const AtlasCase& atlas_case, const StepSettings& settings)
      : backend_(backend), case_(atlas_case) {
    Scene scene = case_.scene;
    scene.parameters.settings = settings;
    scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);  // as the server does
    cloth_ = CreateCloth(backend_, scene);
  }
  ~Play() { backend_.Destroy(cloth_); }
  Play(const Play&) = delete;
  Play& operator=(const Play&) = delete;

  // The next step, together with the other items.
  StepReport Step(std::vector<StepItem> others, bool measure) {
    if (case_.pin_targets_m) targets_m_ = case_.pin_targets_m(step_);
    ++step_;
    others.insert(others.begin(), {cloth_, targets_m_, measure});
    return backend_.Step(others).reports.at(0);
  }
  ClothHandle cloth() const { return cloth_; }

 private:
  Backend& backend_;
  const AtlasCase& case_;
  ClothHandle cloth_;
  std::vector<Vector3d> targets_m_;
  uint32_t step_ = 0;
};

Verdict Judge(const TrialResult& result, bool is_faulted) {
  if (is_faulted) return Verdict::kFaults;
  if (result.max_strain <= kMaxStrain && result.max_gain <= kMaxGain) return Verdict::kSurvives;
  if (result.end_strain <= kMaxStrain && result.end_gain <= kMaxGain) return Verdict::kRecovers;
  return result.warnings.empty() ? Verdict::kBreaks : Verdict::kWarns;
}

}  // namespace

std::string_view VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kSurvives:
      return "survives";
    case Verdict::kRecovers:
      return "recovers";
    case Verdict::kWarns:
      return "warns";
    case Verdict::kBreaks:
      return "breaks";
    case Verdict::kFaults:
      return "faults";
  }
  return "";
}

Neighbour::Neighbour(Backend& backend, const StepSettings& settings)
    : backend_(backend), scene_(Grid(6, 6, 0.5, 0.5, {0, 5})) {
  scene_.parameters.settings = settings;
  Stir(scene_, 0.5);
  alone_ = Create();
  hashes_ = {HashOf(backend_, alone_)};
}

Neighbour::~Neighbour() {
  backend_.Destroy(alone_);
}

ClothHandle Neighbour::Create() const {
  return CreateCloth(backend_, scene_);
}

size_t Neighbour::HashAlone(uint32_t steps) {
  while (hashes_.size() <= steps) {
    StepAlone(backend_, alone_, scene_);
    hashes_.push_back(HashOf(backend_, alone_));
  }
  return hashes_[steps];
}

TrialResult RunTrial(Backend& backend, Neighbour& neighbour, const AtlasCase& atlas_case,
                     const StepSettings& settings, const TrialLimits& limits) {
  const auto start = std::chrono::steady_clock::now();
  const auto passed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const uint32_t planned = PlannedSteps(atlas_case, settings, limits);
  const uint32_t alone_steps = std::min(kAloneSteps, planned);
  const Gauge gauge(atlas_case, settings);
  TrialResult result;
  Warnings warnings;
  bool is_faulted = false;
  size_t hash_in_batch = 0;
  std::vector<double> strains, gains;
  const ClothHandle beside = neighbour.Create();
  {
    Play play(backend, atlas_case, settings);
    while (result.steps < planned && !is_faulted && result.violation.empty()) {
      if (passed_s() > limits.wall_s) {
        result.is_cut = true;
        break;
      }
      ++result.steps;
      const StepReport report = play.Step({{beside, {}, false}}, result.steps == planned);
      is_faulted = report.fault != FaultReason::kNone;
      warnings.Add(report.warnings);
      const ParticleState state = ReadState(backend, play.cloth());
      if (!test::IsFinite(state)) result.violation = "a state that is not finite was read";
      if (!IsFinite(report.measured)) result.violation = "a measurement is not finite";
      strains.push_back(gauge.Strain(state));
      gains.push_back(gauge.Gain(state));
      if (result.steps == alone_steps) hash_in_batch = HashOf(backend, play.cloth());
    }
  }
  const size_t late = strains.size() - (strains.size() + 3) / 4;
  result.max_strain = *std::max_element(strains.begin(), strains.end());
  result.end_strain = *std::max_element(strains.begin() + late, strains.end());
  result.max_gain = *std::max_element(gains.begin(), gains.end());
  result.end_gain = *std::max_element(gains.begin() + late, gains.end());
  result.warnings = warnings.Text();
  result.verdict = Judge(result, is_faulted);

  if (HashOf(backend, beside) != neighbour.HashAlone(result.steps)) {
    result.violation = "the neighbour's bits changed";
  }
  backend.Destroy(beside);
  if (result.steps >= alone_steps) {
    Play alone(backend, atlas_case, settings);
    for (uint32_t step = 0; step < alone_steps; ++step) alone.Step({}, false);
    if (HashOf(backend, alone.cloth()) != hash_in_batch) {
      result.violation = "other bits in a batch than alone";
    }
  }
  result.wall_s = passed_s();
  return result;
}

}  // namespace drape::test
