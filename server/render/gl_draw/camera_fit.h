// A camera that shows everything. Pure.
#pragma once

#include <Eigen/Core>
#include <array>

#include "server/render/picture_spec.h"

namespace drape::render {

// How much of the picture a fitted camera may use: from its centre to each side, as a share of half
// the width or height (0..1].
struct FitShares {
  double right = 0.85;
  double left = 0.85;
  double up = 0.85;
  double down = 0.85;
};

// How far things reach towards the sides of the picture: the largest products of their points with
// CameraFit::directions().
using Reaches = std::array<double, 8>;

// Finds the camera along a view direction that is nearest to what is added, while all of it stays
// within the shares of the picture. Two opposite sides are touched; between the other two it is in
// the middle.
//
// The picture's sides are planes through the eye. With axes r (right), u (up), f (forward) and
// slope t = share * tan(half field of view), a point p is within the right side if r.(p - eye) <= t
// f.(p - eye), that is, d.p <= d.eye with d = r - t f. So of all points only the largest d.p of
// each side counts (its reach A(t)), and for two opposite sides with A <= d_right.eye, B <=
// d_left.eye: f.eye <= -(A + B) / (t_right + t_left).
//
// Sides that are not touched are moved inwards until they are, which needs A at smaller slopes. A
// is convex and is known at the whole and at half the slope: the straight line between them is
// never too small, so nothing leaves the picture, and what is in the middle is so up to that.
class CameraFit {
 public:
  // `view_direction`: from the eye, any length > 0. `aspect`: width / height. The camera's `up` is
  // +Y, unless one looks along it (then -Z, as on a map).
  CameraFit(const Eigen::Vector3d& view_direction, double vertical_field_of_view_rad, double aspect,
            const FitShares& shares);

  // World axes, not of unit length: towards the right, left, upper and lower side, then the same
  // for half the slopes.
  const std::array<Eigen::Vector3d, 8>& directions() const { return directions_; }

  // A ball, or a point (radius 0); world frame.
  void AddBall(const Eigen::Vector3d& center_m, double radius_m);
  // Something that reaches so far from `origin_m`, with a margin around it.
  void AddReaches(const Eigen::Vector3d& origin_m, const Reaches& reaches_m, double margin_m);

  // `center_m`: how far away the target is. Something must have been added.
  Camera Fit(const Eigen::Vector3d& center_m) const;

 private:
  // Of the sides `side` and `side` + 1.
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
