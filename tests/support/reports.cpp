#include "tests/support/reports.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

namespace drape::test {
namespace {

struct NamedNumber {
  const char* name;
  double value;  // exact: no field has more than 53 bits
  bool has_bits_if_zero = true;
};

// The fields that backends fill in. The scheduler fills in the rest.
std::vector<NamedNumber> NumbersOf(const StepReport& report) {
  const StepWarnings& warnings = report.warnings;
  const Measurements& measured = report.measured;
  return {{"iterations", static_cast<double>(report.iterations)},
          {"converged", static_cast<double>(report.converged)},
          {"fault", static_cast<double>(report.fault)},
          {"tolerance_raised", static_cast<double>(warnings.tolerance_raised)},
          {"not_converged", static_cast<double>(warnings.not_converged)},
          {"springs_beyond_limit", static_cast<double>(warnings.springs_beyond_limit)},
          {"elastic_beyond_limit", static_cast<double>(warnings.elastic_beyond_limit)},
          {"springs_gain_energy", static_cast<double>(warnings.springs_gain_energy)},
          {"strain_beyond_limit", static_cast<double>(warnings.strain_beyond_limit)},
          {"max_strain", measured.max_strain},
          {"rms_strain", measured.rms_strain},
          {"strain_p50", measured.strain_p50},
          {"strain_p90", measured.strain_p90},
          {"strain_p99", measured.strain_p99},
          {"rms_motion_m", measured.rms_motion_m},
          {"kinetic_energy_j", measured.kinetic_energy_j},
          {"potential_energy_j", measured.potential_energy_j},
          {"strain_energy_j", measured.strain_energy_j},
          {"lowest_m", measured.lowest_m},
          {"contacts", static_cast<double>(measured.contacts)},
          {"max_penetration_m", measured.max_penetration_m},
          {"max_residual_m", measured.max_residual_m},
          // Younger than the golden files, and rare.
          {"energy_gained", static_cast<double>(warnings.energy_gained), false}};
}

// Of a report with impulses.
std::vector<Eigen::Vector3d> VectorsOf(const StepImpulses& impulses) {
  std::vector<Eigen::Vector3d> vectors;
  for (const ColliderImpulse& collider : impulses.colliders) {
    vectors.push_back(collider.impulse_n_s);
    vectors.push_back(collider.angular_impulse_n_m_s);
  }
  for (const auto& pin : impulses.pins_n_s) vectors.push_back(pin);
  for (const auto& grip : impulses.grips_n_s) vectors.push_back(grip);
  if (!impulses.contacts) return vectors;
  for (const ParticleImpulse& contact : *impulses.contacts) {
    vectors.push_back(Eigen::Vector3d(contact.particle, contact.collider, 0));
    vectors.push_back(contact.impulse_n_s);
  }
  return vectors;
}

std::string DifferenceOfImpulses(const StepReport& actual, const StepReport& expected) {
  const bool has_some = actual.impulses != nullptr;
  if (has_some != (expected.impulses != nullptr)) return "one has no impulses; ";
  if (!has_some) return "";
  if (actual.impulses->contacts.has_value() != expected.impulses->contacts.has_value()) {
    return "one has no contacts; ";
  }
  const auto vectors = VectorsOf(*actual.impulses), others = VectorsOf(*expected.impulses);
  if (vectors.size() != others.size()) return "different numbers of impulses; ";
  std::ostringstream text;
  text.precision(17);
  for (size_t k = 0; k < vectors.size(); ++k) {
    if (vectors[k] == others[k]) continue;
    text << "impulse " << k << ": " << vectors[k].transpose() << " instead of "
         << others[k].transpose() << "; ";
  }
  return text.str();
}

}  // namespace

std::string DifferenceOf(const StepReport& actual, const StepReport& expected) {
  std::ostringstream text;
  text.precision(17);
  const std::vector<NamedNumber> numbers = NumbersOf(actual), others = NumbersOf(expected);
  for (size_t k = 0; k < numbers.size(); ++k) {
    if (numbers[k].value == others[k].value) continue;
    text << numbers[k].name << ": " << numbers[k].value << " instead of " << others[k].value
         << "; ";
  }
  return text.str() + DifferenceOfImpulses(actual, expected);
}

std::string ReportBits(const StepReport& report) {
  std::string bits;
  for (const NamedNumber& number : NumbersOf(report)) {
    if (number.value == 0 && !number.has_bits_if_zero) continue;
    const double value =
        std::isnan(number.value) ? std::numeric_limits<double>::quiet_NaN() : number.value;
    bits.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  return bits;
}

}  // namespace drape::test
