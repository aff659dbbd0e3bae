// The scenes of the work-precision diagrams. Plain values; nothing is random.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/accuracy/methods.h"
#include "tests/support/scenes.h"

namespace drape::bench {

// The reference positions at the end, and the estimate of their error.
struct PositionReference {
  std::vector<Eigen::Vector3d> positions_m = {};
  std::string solver;   // "planar chain": one angle per link, Runge-Kutta; "direct": SHAKE + Newton
  double step_s = 0;    // of the finest run
  double change_m = 0;  // from the last halving of the step
  double error_m = 0;   // estimated
};

// Frames are 1/60 s.
inline constexpr double kFrame_s = 1.0 / 60;

struct AccuracyScene {
  std::string name;   // also in the tables: letters, digits and _
  std::string title;  // one line
  test::Scene scene;
  double duration_s = 1;
  double window_start_s = 0;  // strain counts from here on
  double length_m = 1;        // l of m g l, the unit of energy
  PointGrid points = PointGrid::kFew;
  bool has_peer = false;      // Bullet plays it too
  bool all_backends = false;  // the presets on every backend, not only the first
  // Unset: no reference for positions (the motion is chaotic, or its limit is locked).
  std::function<PositionReference()> reference = {};

  uint32_t frame_count() const;
  uint32_t window_start_frame() const;
};

// In the order of the tables. quick: the smallest versions, a few frames.
std::vector<AccuracyScene> AccuracyScenes(bool is_quick);

// Scenes whose motion at other steps, energy over a long time or two parts of the error are
// measured too; all but the last have a reference.
AccuracyScene PendulumScene();
AccuracyScene ChainScene(bool is_quick);
AccuracyScene SwingScene(uint32_t side, bool is_quick);
AccuracyScene CurtainScene(uint32_t side, bool is_quick);
// One column of the curtain: the chain that all columns are.
AccuracyScene CurtainColumnScene(uint32_t rows, bool is_quick);
AccuracyScene TwoCornersScene(uint32_t side, double duration_s);

}  // namespace drape::bench
