#include "server/render/gl_draw/camera_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/core/check.h"

namespace drape::render {

namespace {

// Where the eye must be for one axis of the picture, in the camera's coordinates: a ball with
// centre c (across), depth z and radius r is within |across - eye| <= slope (z - eye_depth) if
//   c - slope z + r w <= eye - slope eye_depth   and  -c - slope z + r w <= -eye - slope eye_depth,
// w = sqrt(1 + slope^2): the distance of a plane through the eye from the ball's centre is at least
// r. With the largest left sides A and B: eye_depth <= -(A + B) / (2 slope), and in the middle eye
// = (A - B) / 2.
struct AxisFit {
  double eye = 0;
  double eye_depth = 0;
};

AxisFit FitAxis(std::span<const FitBall> balls, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& axis, const Eigen::Vector3d& forward, double slope) {
  double a = -std::numeric_limits<double>::infinity();
  double b = a;
  for (const FitBall& ball : balls) {
    const Eigen::Vector3d center = ball.center_m - origin;
    const double across = axis.dot(center);
    const double rest = ball.radius_m * std::sqrt(1 + slope * slope) - slope * forward.dot(center);
    a = std::max(a, across + rest);
    b = std::max(b, -across + rest);
  }
  return {.eye = (a - b) / 2, .eye_depth = -(a + b) / (2 * slope)};
}

}  // namespace

Camera FitCamera(std::span<const FitBall> balls, const Eigen::Vector3d& view_direction,
                 double vertical_field_of_view_rad, double aspect, double fill) {
  DRAPE_CHECK(!balls.empty(), "a camera needs something to look at");
  const Eigen::Vector3d forward = view_direction.normalized();
  constexpr double kAlongUp = 0.9999;
  const bool looks_along_up = std::abs(forward.y()) > kAlongUp;
  const Eigen::Vector3d up_hint =
      looks_along_up ? Eigen::Vector3d(-Eigen::Vector3d::UnitZ()) : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d right = forward.cross(up_hint).normalized();
  const Eigen::Vector3d up = right.cross(forward);
  // Small numbers, however far from the origin of the world everything is.
  const Eigen::Vector3d origin = balls.front().center_m;
  const double slope = fill * std::tan(vertical_field_of_view_rad / 2);
  const AxisFit horizontal = FitAxis(balls, origin, right, forward, slope * aspect);
  const AxisFit vertical = FitAxis(balls, origin, up, forward, slope);
  const double eye_depth = std::min(horizontal.eye_depth, vertical.eye_depth);

  // The target: at the mean depth of what is shown.
  double depth_sum = 0;
  for (const FitBall& ball : balls) depth_sum += forward.dot(ball.center_m - origin);
  const double depth = depth_sum / static_cast<double>(balls.size());
  const Eigen::Vector3d across = origin + horizontal.eye * right + vertical.eye * up;
  return {.eye_m = across + eye_depth * forward,
          .target_m = across + std::max(depth, eye_depth + 1e-3) * forward,
          .up = up_hint,
          .vertical_field_of_view_rad = vertical_field_of_view_rad};
}

}  // namespace drape::render
