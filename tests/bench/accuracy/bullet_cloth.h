// The outside peer: the soft body of Bullet (Debian: libbullet-dev), links only, single precision.
#pragma once

#include <memory>
#include <vector>

#include "tests/bench/accuracy/contestant.h"

namespace drape::bench {

// Bullet's settings: the frame in `substeps` calls of its step, each with `iterations` sweeps over
// the links ("piterations"). Its stiffness factor is 1, its damping 0.
struct BulletSettings {
  uint32_t substeps = 1;
  uint32_t iterations = 1;
};

// Plays scenes of inextensible constraints, still pins and spheres. The scene must outlive it.
std::unique_ptr<Contestant> MakeBulletCloth(const test::Scene& scene,
                                            const BulletSettings& settings);

// One entry per setting that is compared.
std::vector<Entry> BulletEntries(const test::Scene& scene, bool is_quick);

}  // namespace drape::bench
