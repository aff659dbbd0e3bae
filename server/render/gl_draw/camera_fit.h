// A camera that shows everything. Pure.
#pragma once

#include <Eigen/Core>
#include <array>

#include "server/render/picture_spec.h"

namespace drape::render {

// The part of the picture that a fitted camera may use: from the centre to each side, as a share of
// half the width or height (0..1].
struct FitShares {
  double right = 0.85;
  double left = 0.85;
  double up = 0.85;
  double down = 0.85;
};

// The extent of things towards the sides of the picture: the largest dot products of their points
// with CameraFit::directions().
using Reaches = std::array<double, 8>;

// Finds the nearest camera along a view direction that keeps everything that was added within the
// shares of the picture. The content touches two opposite sides and is centred between the other
// two.
//
// The picture's sides are planes through the eye. With axes r (right), u (up), f (forward) and
// slope t = share * tan(half field of view), a point p is within the right side if r.(p - eye) <= t
// f.(p - eye), that is, d.p <= d.eye with d = r - t f. So only the largest d.p of each side counts
// (its reach A(t)), and for two opposite sides with A <= d_right.eye, B <= d_left.eye: f.eye <=
// -(A + B) / (t_right + t_left).
//
// Sides that are not touched move inwards until they are, which needs A at smaller slopes. A is
// convex and known at the full and at half the slope. The straight line between these values is
// never too small, so nothing leaves the picture; the centring is approximate by the same amount.
class CameraFit {
 public:
  // `view_direction`: from the eye, any length > 0. `aspect`: width / height. The camera's `up` is
  // +Y, or -Z (as on a map) if the view is along +Y.
  CameraFit(const Eigen::Vector3d& view_direction, double vertical_field_of_view_rad, double aspect,
            const FitShares& shares);

  // World axes, not of unit length: towards the right, left, upper and lower side, then the same
  // for half the slopes.
  const std::array<Eigen::Vector3d, 8>& directions() const { return directions_; }

  // A ball, or a point (radius 0); world frame.
  void AddBall(const Eigen::Vector3d& center_m, double radius_m);
  // Something with these reaches from `origin_m`, plus a margin.
  void AddReaches(const Eigen::Vector3d& origin_m, const Reaches& reaches_m, double margin_m);

  // `center_m` sets the distance of the target. Something must have been added.
  Camera Fit(const Eigen::Vector3d& center_m) const;

 private:
  // For the sides `side` and `side` + 1.
  double DepthOf(size_t side) const;
  double AcrossOf(size_t side, double depth) const;

  double field_of_view_rad_;
  Eigen::Vector3d right_;
  Eigen::Vector3d up_;
  Eigen::Vector3d forward_;
  Eigen::Vector3d up_hint_;
  std::array<double, 4> slopes_;
  std::array<Eigen::Vector3d, 8> directions_;
  Reaches reaches_m_;
};

}  // namespace drape::render
