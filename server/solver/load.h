// How heavy a cloth is for its substeps, and the substeps that a heavy one gets.
#pragma once

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// A cloth that catches a body holds more than its weight for a moment [-]: 14 to 33 times, as the
// mean of a frame, in tests/physics/body_test.cpp. Larger: more substeps also for bodies that lie
// still; smaller: cloths stretch when they catch one (3 : 1 in mass by 6 % instead of 2), and throw
// it back with more energy than it had.
inline constexpr double kBodyImpact = 20;

// Gamma = h^2 T / (m L) [-] of the worst link, if it carried the whole weight of the cloth and what
// its bodies may pull (kBodyImpact): how near start directions are to being unstable
// (server/solver/method.md, "Direction").
double WeightGamma(const SceneModel& model, const ClothParameters& parameters);

// The same where each pin carries its part of the weight, or without pins one grip; 0 without both,
// since nothing pulls then.
// The share of the error that one sweep per substep leaves grows with it: 10 to 20 % of the worst
// link at 0.4 to 0.5 (`./run bench stability`).
double LoadRatio(const SceneModel& model, const ClothParameters& parameters);

// The same of pins alone, and of the cloth's own weight: what bodies pull for a moment does not
// make anything flutter.
double OwnLoadRatio(const SceneModel& model, const ClothParameters& parameters);

// The parameters that a backend gets: with as many substeps as keep LoadRatio within
// settings.load_limit, at most kMaxLoadFactor times the requested number.
ClothParameters RaiseSubsteps(const SceneModel& model, ClothParameters parameters);

}  // namespace drape
