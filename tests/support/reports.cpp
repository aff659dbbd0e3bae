#include "tests/support/reports.h"

#include <sstream>

namespace drape::test {
namespace {

class Differences {
 public:
  Differences() { text_.precision(17); }
  template <class Value>
  void Compare(const char* name, const Value& actual, const Value& expected) {
    if (actual == expected) return;
    text_ << name << ": " << actual << " instead of " << expected << "; ";
  }
  std::string Text() const { return text_.str(); }

 private:
  std::ostringstream text_;
};

}  // namespace

std::string DifferenceOf(const StepReport& actual, const StepReport& expected) {
  Differences found;
  found.Compare("iterations", actual.iterations, expected.iterations);
  found.Compare("converged", actual.converged, expected.converged);
  found.Compare("fault", static_cast<int>(actual.fault), static_cast<int>(expected.fault));
  const StepWarnings &warned = actual.warnings, &should_warn = expected.warnings;
  found.Compare("tolerance_raised", warned.tolerance_raised, should_warn.tolerance_raised);
  found.Compare("not_converged", warned.not_converged, should_warn.not_converged);
  found.Compare("springs_beyond_limit", warned.springs_beyond_limit,
                should_warn.springs_beyond_limit);
  found.Compare("elastic_beyond_limit", warned.elastic_beyond_limit,
                should_warn.elastic_beyond_limit);
  found.Compare("springs_gain_energy", warned.springs_gain_energy, should_warn.springs_gain_energy);
  const Measurements &a = actual.measured, &e = expected.measured;
  found.Compare("max_strain", a.max_strain, e.max_strain);
  found.Compare("rms_strain", a.rms_strain, e.rms_strain);
  found.Compare("kinetic_energy_j", a.kinetic_energy_j, e.kinetic_energy_j);
  found.Compare("potential_energy_j", a.potential_energy_j, e.potential_energy_j);
  found.Compare("strain_energy_j", a.strain_energy_j, e.strain_energy_j);
  found.Compare("lowest_m", a.lowest_m, e.lowest_m);
  found.Compare("contacts", a.contacts, e.contacts);
  found.Compare("max_penetration_m", a.max_penetration_m, e.max_penetration_m);
  found.Compare("max_residual_m", a.max_residual_m, e.max_residual_m);
  return found.Text();
}

}  // namespace drape::test
