// The stability atlas: tables of cases at and beyond the limits of stability.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/support/scenes.h"

namespace drape::test {

// A scene to be stepped, and errors that even a perfect solver could not avoid. Its settings except
// the time step are the method's.
struct AtlasCase {
  Scene scene;
  double time_step_s = 1.0 / 60;
  double length_m = 1;        // of the cloth, for its unit of energy m g l
  double least_strain = 0;    // of the best compromise between its constraints
  double allowed_gain_j = 0;  // work that pins and colliders may do on it
  double duration_s = 0;      // of the play; 0: as in TrialLimits
  uint32_t substeps = 0;      // of the whole play, instead of its duration (soak)
  // The positions of the pins at the end of a step, counted from 0; unset: they stay.
  std::function<std::vector<Eigen::Vector3d>(uint32_t step)> pin_targets_m{};
};

// The smallest form of the atlas that has a value; larger forms have it too.
enum class AtlasForm { kThin, kShort, kFull };

struct AxisValue {
  std::string label;
  double value = 0;
  AtlasForm form = AtlasForm::kThin;  // the smallest one with this value
};

struct Axis {
  std::string name;
  std::vector<AxisValue> values;
};

struct AtlasTable {
  std::string name;   // letters, digits and _
  std::string title;  // a description in words
  Axis rows, columns;
  std::function<AtlasCase(double row, double column)> make;
  // The cells in which REALTIME has to survive or recover: a time step of at most 1/60 s, mass
  // ratios up to 1000, up to 100 g, all degenerate starts.
  std::function<bool(double row, double column)> is_within_bar;
};

// All tables, their axes thinned to the form.
std::vector<AtlasTable> AtlasTables(AtlasForm form);

// The settings that are tried: presets, and REALTIME with one switch changed.
struct AtlasMethod {
  std::string name;
  StepSettings settings;
};
std::vector<AtlasMethod> AtlasMethods(AtlasForm form);

}  // namespace drape::test
