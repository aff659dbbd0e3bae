// Cloths that touch themselves: folding, piling up, twisted, draped, and one that never does.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/scenes.h"

namespace drape::bench {

// A scene, and what changes in it before a frame.
struct ContactPlay {
  std::string name;
  test::Scene scene;
  uint32_t frames = 0;
  // Frame from 0, on the scene as it was in the frame before. Whether its parameters changed.
  std::function<bool(uint32_t frame, test::Scene& scene)> change;
};

struct ContactPlayOptions {
  uint32_t side = 32;  // particles along a side of the sheet, or around the tube
  uint32_t substeps = 52;
  double thickness_m = 0.003;
};

// fold: a sheet of 1 m dropped on its edge. pile: over a sphere that vanishes after half a second.
// twist: a tube that is turned by one turn and shortened. drape: over a sphere. swing: by two
// corners. nothing: by its first row, flat, nowhere near itself. REALTIME, friction of 0.3.
std::vector<ContactPlay> ContactPlays(const ContactPlayOptions& options);

}  // namespace drape::bench
