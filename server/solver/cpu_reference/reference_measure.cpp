#include "server/solver/cpu_reference/reference_measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/solver/cpu_reference/reference_constraints.h"
#include "server/solver/cpu_reference/reference_contact.h"
#include "server/solver/cpu_reference/reference_elastic.h"
#include "server/solver/solver_constants.h"

namespace drape {

namespace {

double Square(double x) {
  return x * x;
}

double RoundedDown(double strain) {
  if (strain < kMinPercentile) return 0;
  int exponent = 0;
  const double fraction = std::frexp(std::min(strain, kMaxPercentile), &exponent);
  constexpr int kBits = kPercentileBits;
  return std::ldexp(std::floor(std::ldexp(fraction, kBits)), exponent - kBits);
}

// By nearest rank. `strains`: of at least one link, >= 0; reordered.
double Percentile(size_t percent, std::vector<double>& strains) {
  const size_t rank = (strains.size() * percent + 99) / 100;
  const auto found = strains.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(strains.begin(), found, strains.end());
  return RoundedDown(*found);
}

void MeasureStrain(const SceneModel& model, const ParticleState& state,
                   std::span<const double> rest_lengths_m, Measurements& measured) {
  double sum_sq = 0;
  std::vector<double> strains;
  for (uint32_t k = 0; k < model.constraint_count(); ++k) {
    const auto [i, j, model_length, compliance, kind] = model.constraints()[k];
    const double rest_length = rest_lengths_m.empty() ? model_length : rest_lengths_m[k];
    const double error =
        Violation(kind, (state.positions_m[j] - state.positions_m[i]).norm() - rest_length);
    const double strain = error / rest_length;
    measured.max_strain = std::max(measured.max_strain, std::abs(strain));
    sum_sq += Square(strain);
    strains.push_back(std::abs(strain));
    if (compliance > 0) measured.strain_energy_j += Square(error) / (2 * compliance);
  }
  if (model.constraint_count() > 0) {
    measured.rms_strain = std::sqrt(sum_sq / model.constraint_count());
    measured.strain_p50 = Percentile(50, strains);
    measured.strain_p90 = Percentile(90, strains);
    measured.strain_p99 = Percentile(99, strains);
  }
  for (const auto& [i, j, compliance] : model.joints()) {
    const double error_sq = (state.positions_m[j] - state.positions_m[i]).squaredNorm();
    if (compliance > 0) measured.strain_energy_j += error_sq / (2 * compliance);
  }
  for (const Spring& spring : model.springs()) {
    const double error =
        (state.positions_m[spring.j] - state.positions_m[spring.i]).norm() - spring.rest_length_m;
    measured.strain_energy_j += spring.stiffness_n_per_m / 2 * Square(error);
  }
  for (const ElasticElement& element : model.elastic_elements()) {
    const double error = DeflectionOf_m(element, [&](uint32_t i) { return state.positions_m[i]; });
    measured.strain_energy_j += element.stiffness_n_per_m / 2 * Square(error);
  }
}

void MeasureContacts(const SceneModel& model, const ClothParameters& parameters,
                     const ParticleState& state, Measurements& measured) {
  const double margin = kContactMarginRatio * model.length_scale_m();
  for (const Eigen::Vector3d& p : state.positions_m) {
    double smallest_gap = std::numeric_limits<double>::infinity();
    for (size_t c = 0; c < parameters.colliders.size(); ++c) {
      const Eigen::Vector3d place =
          parameters.collider_motions.empty() ? p : parameters.collider_motions[c].DescribedAt(p);
      const double gap = ContactAt(parameters.colliders[c], parameters.thickness_m, place).gap;
      smallest_gap = std::min(smallest_gap, gap);
    }
    measured.contacts += smallest_gap <= margin;
    measured.max_penetration_m = std::max(measured.max_penetration_m, -smallest_gap);
  }
}

}  // namespace

FaultReason FindFault(const ParticleState& state) {
  FaultReason fault = FaultReason::kNone;
  for (size_t i = 0; i < state.positions_m.size(); ++i) {
    const Eigen::Vector3d& p = state.positions_m[i];
    const Eigen::Vector3d& v = state.velocities_m_per_s[i];
    if (!p.allFinite() || !v.allFinite()) return FaultReason::kNotFinite;
    if (v.norm() > kMaxSpeed_m_per_s || p.cwiseAbs().maxCoeff() > kMaxCoordinate_m) {
      fault = FaultReason::kRunaway;  // unless another particle is not even finite
    }
  }
  return fault;
}

Measurements MeasureState(const SceneModel& model, const ClothParameters& parameters,
                          const ParticleState& state, std::span<const double> rest_lengths_m) {
  Measurements measured;
  measured.lowest_m = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    const double mass = model.masses_kg()[i];
    measured.kinetic_energy_j += mass / 2 * state.velocities_m_per_s[i].squaredNorm();
    measured.potential_energy_j -= mass * parameters.gravity_m_per_s2.dot(state.positions_m[i]);
    measured.lowest_m = std::min(measured.lowest_m, state.positions_m[i].y());
  }
  MeasureStrain(model, state, rest_lengths_m, measured);
  MeasureContacts(model, parameters, state, measured);
  return measured;
}

double RmsMotion(const ParticleState& start, const ParticleState& end) {
  double sum_sq = 0;
  for (size_t i = 0; i < end.positions_m.size(); ++i) {
    sum_sq += (end.positions_m[i] - start.positions_m[i]).squaredNorm();
  }
  return std::sqrt(sum_sq / static_cast<double>(end.positions_m.size()));
}

}  // namespace drape
