// A camera that shows everything. Pure.
#pragma once

#include <Eigen/Core>
#include <span>

#include "server/render/picture_spec.h"

namespace drape::render {

// Something that must be in the picture: a ball, or a point (radius 0). World frame.
struct FitBall {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double radius_m = 0;
};

// The camera along `view_direction` (from the eye; any length > 0) that is nearest to the balls, at
// least one, while all of them stay within the share `fill` (0..1) of the picture's width and
// height; they touch its edges on two opposite sides and are in the middle between the others. `up`
// is +Y, unless one looks along it (then -Z, as on a map). `aspect`: width / height.
Camera FitCamera(std::span<const FitBall> balls, const Eigen::Vector3d& view_direction,
                 double vertical_field_of_view_rad, double aspect, double fill);

}  // namespace drape::render
