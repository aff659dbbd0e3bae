#include "server/render/gl_draw/camera_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/core/check.h"

namespace drape::render {

using Eigen::Vector3d;

CameraFit::CameraFit(const Vector3d& view_direction, double vertical_field_of_view_rad,
                     double aspect, const FitShares& shares)
    : field_of_view_rad_(vertical_field_of_view_rad), forward_(view_direction.normalized()) {
  constexpr double kAlongUp = 0.9999;
  const bool looks_along_up = std::abs(forward_.y()) > kAlongUp;
  up_hint_ = looks_along_up ? Vector3d(-Vector3d::UnitZ()) : Vector3d(Vector3d::UnitY());
  right_ = forward_.cross(up_hint_).normalized();
  up_ = right_.cross(forward_);
  const double slope = std::tan(vertical_field_of_view_rad / 2);
  slopes_ = {slope * aspect * shares.right, slope * aspect * shares.left, slope * shares.up,
             slope * shares.down};
  directions_ = {Vector3d(right_ - slopes_[0] * forward_),
                 Vector3d(-right_ - slopes_[1] * forward_), Vector3d(up_ - slopes_[2] * forward_),
                 Vector3d(-up_ - slopes_[3] * forward_)};
  reaches_m_.fill(-std::numeric_limits<double>::infinity());
}

void CameraFit::AddBall(const Vector3d& center_m, double radius_m) {
  AddReaches(center_m, {0, 0, 0, 0}, radius_m);
}

void CameraFit::AddReaches(const Vector3d& origin_m, const Reaches& reaches_m, double margin_m) {
  for (size_t side = 0; side < directions_.size(); ++side) {
    const Vector3d& direction = directions_[side];
    reaches_m_[side] = std::max(
        reaches_m_[side], direction.dot(origin_m) + reaches_m[side] + margin_m * direction.norm());
  }
}

Camera CameraFit::Fit(const Vector3d& center_m) const {
  DRAPE_CHECK(std::isfinite(reaches_m_[0]), "a camera needs something to look at");
  const auto depth_of = [this](size_t side) {
    return -(reaches_m_[side] + reaches_m_[side + 1]) / (slopes_[side] + slopes_[side + 1]);
  };
  const double depth = std::min(depth_of(0), depth_of(2));
  // In the middle of where both sides allow the eye to be.
  const auto across_of = [this, depth](size_t side) {
    return ((reaches_m_[side] + slopes_[side] * depth) -
            (reaches_m_[side + 1] + slopes_[side + 1] * depth)) /
           2;
  };
  const Vector3d axis_point = across_of(0) * right_ + across_of(2) * up_;
  const double target_depth = forward_.dot(center_m);
  // Whatever the target's distance, the camera is the same.
  const double least = 1e-9 * std::max(1.0, std::abs(depth)) + 1e-6;
  return {.eye_m = axis_point + depth * forward_,
          .target_m = axis_point + std::max(target_depth, depth + least) * forward_,
          .up = up_hint_,
          .vertical_field_of_view_rad = field_of_view_rad_};
}

}  // namespace drape::render
