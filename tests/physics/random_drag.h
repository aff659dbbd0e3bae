// Cloths that what is held drags over a collider that rests, by seeds.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "tests/support/scenes.h"

namespace drape::test {

// A towel that falls onto a collider while one or two particles of its first row are held beyond
// that, and is then drawn over it.
struct Drag {
  Scene scene;
  bool is_mesh = false;
  std::vector<uint32_t> held;
  std::vector<Eigen::Vector3d> starts;      // of what is held
  std::vector<Eigen::Vector3d> velocities;  // the same
  bool is_gripped = false;                  // else it is pinned
  double cell_m = 0;
  double settle_s = 0.5, drag_s = 0;

  // What is held, `since_s` after the fall.
  std::vector<Grip> HeldAt(double since_s) const {
    std::vector<Grip> grips;
    for (size_t k = 0; k < held.size(); ++k) {
      grips.push_back({held[k], starts[k] + std::clamp(since_s, 0.0, drag_s) * velocities[k]});
    }
    return grips;
  }
};

// 0.5 to 0.8 m wide, of 12 to 24 particles a side: grids and meshes, pinned and gripped, in steps
// of 1/60 and 1/120 s, over tables, boxes, cylinders and thin capsules. Every fifth is far from the
// origin.
Drag RandomDrag(uint32_t seed);

// More kinds, all at the origin: fabrics too, steps of 1/240 to 1/30 s, any friction, also balls
// and thick capsules; what is held may come closer together on the way, never apart. The cloth is
// damped by 2/s.
Drag RandomDragToRest(uint32_t seed);

}  // namespace drape::test
