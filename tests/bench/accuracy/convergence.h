// Measures other than run time against error: orders, energy over a long time, the two parts of the
// error, creep. Not timed.
#pragma once

#include "tests/bench/bench.h"

namespace drape::bench {

// accuracy_order.csv: the error of ACCURATE at several steps, on the first backend as it is and on
// `reference` with a tight tolerance.
// accuracy_energy.csv: energy of the presets over 10 s without physical damping.
// accuracy_split.csv: algebraic error (against converged sweeps of the same step) and
// discretisation error (of those against the exact motion), on `reference`.
// accuracy_creep.csv: how far a patch that sticks to an incline moves in 10 s.
void MeasureConvergence(Bench& bench);

}  // namespace drape::bench
