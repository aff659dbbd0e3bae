// The table `random` of the subcommand `stability`: random cloths, and what energy they gain.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/stability/atlas/atlas.h"

namespace drape::bench {

inline constexpr char kRandomTable[] = "random";  // its name among those of the atlas

// -> stability_random.csv: a row per kind of tests/support/random_cloths.h, method and backend. The
// first backend steps 43 cloths of each kind (301 in all) for 5 s by every method, the others 4 for
// 3 s by REALTIME unless `is_full`.
void MeasureRandomCloths(Bench& bench, const std::vector<test::AtlasMethod>& methods, bool is_full);

}  // namespace drape::bench
