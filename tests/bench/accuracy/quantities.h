// Quantities with a value that is known: closed forms, references, and what must depend on neither
// the step nor the resolution -> accuracy_quantities.csv. Not timed.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/bench/accuracy/accuracy_scenes.h"
#include "tests/bench/bench.h"

namespace drape::bench {

struct Quantity {
  std::string name;
  std::string unit;  // "m"; "-"
  // From the states after each of the last frames of the play.
  std::function<double(std::span<const ParticleState>)> of;
  // Unset: its value in the first scene of the kind that has it, by the same method; nothing in
  // that scene.
  std::optional<double> expected = {};
};

// A play, and what is measured at its end.
struct QuantityScene {
  std::string name;
  test::Scene scene = {};
  double duration_s = 1;
  double time_step_s = kFrame_s;
  uint32_t last_states = 1;
  bool is_slow = false;  // REALTIME alone
  std::vector<Quantity> quantities = {};
};

struct QuantityKind {
  std::string name;   // also in the table: letters, digits and _
  std::string title;  // one line
  // quick: one small scene or two, a few frames.
  std::function<std::vector<QuantityScene>(bool is_quick)> scenes;
};

// In the order of the table.
const std::vector<QuantityKind>& QuantityKinds();

// The kinds of these names, on the first backend; all of them if there is none. std::runtime_error
// names one that does not exist.
void MeasureQuantities(Bench& bench, const std::vector<std::string>& names);

}  // namespace drape::bench
