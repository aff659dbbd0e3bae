// Work-precision diagrams -> accuracy.csv, accuracy_references.csv and the tables of convergence.h
// and quantities.h.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/accuracy/plays.h"
#include "tests/bench/bench.h"

namespace drape::bench {

struct AccuracyOptions {
  // Only these, and these kinds of quantities.h; both empty: all, and the tables of convergence.h.
  std::vector<std::string> scenes, quantities;
  std::vector<std::string> methods;  // besides those of methods.cpp: "NAME: substeps=16 ..."
  PlayLimits limits;
};

// On the first backend; std::runtime_error names a scene or method that does not exist.
void MeasureAccuracy(Bench& bench, const AccuracyOptions& options);

}  // namespace drape::bench
