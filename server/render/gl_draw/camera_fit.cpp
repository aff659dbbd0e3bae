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
  const std::array<Vector3d, 4> outward = {right_, Vector3d(-right_), up_, Vector3d(-up_)};
  for (size_t side = 0; side < outward.size(); ++side) {
    directions_[side] = outward[side] - slopes_[side] * forward_;
    directions_[side + 4] = outward[side] - slopes_[side] / 2 * forward_;
  }
  reaches_m_.fill(-std::numeric_limits<double>::infinity());
}

void CameraFit::AddBall(const Vector3d& center_m, double radius_m) {
  AddReaches(center_m, {}, radius_m);
}

void CameraFit::AddReaches(const Vector3d& origin_m, const Reaches& reaches_m, double margin_m) {
  for (size_t side = 0; side < directions_.size(); ++side) {
    const Vector3d& direction = directions_[side];
    reaches_m_[side] = std::max(
        reaches_m_[side], direction.dot(origin_m) + reaches_m[side] + margin_m * direction.norm());
  }
}

double CameraFit::DepthOf(size_t side) const {
  return -(reaches_m_[side] + reaches_m_[side + 1]) / (slopes_[side] + slopes_[side + 1]);
}

// Scales both slopes by the factor s, 1/2 to 1, at which both sides touch: the gap A(s) + B(s) + s
// (t_right + t_left) depth is 0 there, and linear between the ends.
double CameraFit::AcrossOf(size_t side, double depth) const {
  const double slopes = slopes_[side] + slopes_[side + 1];
  const double gap_whole = reaches_m_[side] + reaches_m_[side + 1] + slopes * depth;
  const double gap_half = reaches_m_[side + 4] + reaches_m_[side + 5] + slopes / 2 * depth;
  // The gap is never above 0 at the full slopes. If it is above 0 at half, the sides touch in
  // between.
  const double share = gap_half > 0 ? gap_half / (gap_half - gap_whole) : 0;
  const auto between = [&](size_t k, double half_slope) {
    const double whole = reaches_m_[k] + 2 * half_slope * depth;
    const double half = reaches_m_[k + 4] + half_slope * depth;
    return half + share * (whole - half);
  };
  const double lowest = between(side, slopes_[side] / 2);
  const double highest = -between(side + 1, slopes_[side + 1] / 2);
  return (lowest + highest) / 2;
}

Camera CameraFit::Fit(const Vector3d& center_m) const {
  DRAPE_CHECK(std::isfinite(reaches_m_[0]), "a camera needs something to look at");
  const double depth = std::min(DepthOf(0), DepthOf(2));
  const Vector3d axis_point = AcrossOf(0, depth) * right_ + AcrossOf(2, depth) * up_;
  // The target's distance does not change the picture.
  const double least = 1e-9 * std::max(1.0, std::abs(depth)) + 1e-6;
  return {.eye_m = axis_point + depth * forward_,
          .target_m = axis_point + std::max(forward_.dot(center_m), depth + least) * forward_,
          .up = up_hint_,
          .vertical_field_of_view_rad = field_of_view_rad_};
}

}  // namespace drape::render
