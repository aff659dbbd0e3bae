#include "server/render/gl_draw/camera_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "server/render/gl_draw/projection.h"

namespace drape::render {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFieldOfView_rad = 0.6;
constexpr FitShares kShares{.right = 0.8, .left = 0.8, .up = 0.8, .down = 0.8};

// -1..1 over the picture, right and up.
Vector2d Project(const Camera& camera, double aspect, const Vector3d& p) {
  const Vector3d from_eye = p - camera.eye_m;
  const Eigen::Vector4d clip = ClipFromEye(camera, aspect, 0.01) * from_eye.homogeneous();
  return clip.head<2>() / clip.w();
}

// A ball fills the share when the planes through the eye touch it: at r sqrt(1 + 1/t^2) from it.
TEST(CameraFitTest, OneBallInClosedForm) {
  const Vector3d center(3, -2, 5);
  constexpr double kRadius_m = 0.7;
  for (const double aspect : {1.0, 2.0, 0.5}) {
    CameraFit fit(Vector3d(0.3, -0.5, -1), kFieldOfView_rad, aspect, kShares);
    fit.AddBall(center, kRadius_m);
    const Camera camera = fit.Fit(center);
    const double slope = 0.8 * std::tan(kFieldOfView_rad / 2) * std::min(aspect, 1.0);
    const double distance = kRadius_m * std::sqrt(1 + 1 / (slope * slope));
    EXPECT_NEAR((camera.eye_m - center).norm(), distance, 1e-9);
    EXPECT_NEAR((camera.target_m - center).norm(), 0, 1e-9);
    EXPECT_NEAR(
        (camera.target_m - camera.eye_m).normalized().dot(Vector3d(0.3, -0.5, -1).normalized()), 1,
        1e-12);
    EXPECT_EQ(camera.vertical_field_of_view_rad, kFieldOfView_rad);
  }
}

// A wall w wide and h high, seen straight on: the distance is that of the tighter side.
TEST(CameraFitTest, WallInClosedForm) {
  const double slope = 0.8 * std::tan(kFieldOfView_rad / 2);
  for (const auto& [width, height] : {std::pair(2.0, 1.0), std::pair(1.0, 3.0)}) {
    CameraFit fit(-Vector3d::UnitZ(), kFieldOfView_rad, 1.5, kShares);
    for (const double x : {0.0, width}) {
      for (const double y : {0.0, height}) fit.AddBall(Vector3d(x, y, 1), 0);
    }
    const Camera camera = fit.Fit(Vector3d(width / 2, height / 2, 1));
    const double distance = std::max(width / 2 / (1.5 * slope), height / 2 / slope);
    EXPECT_NEAR((camera.eye_m - Vector3d(width / 2, height / 2, 1 + distance)).norm(), 0, 1e-9);
  }
}

TEST(CameraFitTest, EverythingIsInsideAndTwoSidesAreTouched) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 40; ++i) {
    points.push_back({std::sin(2.1 * i), 0.4 * std::cos(1.3 * i), 1.5 * std::sin(0.7 * i + 1)});
  }
  for (const double aspect : {0.5, 1.0, 1.33, 3.0}) {
    CameraFit fit(Vector3d(-0.55, -0.42, -0.72), kFieldOfView_rad, aspect, kShares);
    for (const Vector3d& p : points) fit.AddBall(p, 0);
    const Camera camera = fit.Fit(Vector3d::Zero());
    Eigen::AlignedBox2d shown;
    for (const Vector3d& p : points) shown.extend(Project(camera, aspect, p));
    EXPECT_LE(shown.max().maxCoeff(), 0.8 + 1e-9);
    EXPECT_GE(shown.min().minCoeff(), -0.8 - 1e-9);
    const bool touches_sides = shown.sizes().x() > 1.6 - 1e-9;
    const bool touches_ends = shown.sizes().y() > 1.6 - 1e-9;
    EXPECT_TRUE(touches_sides || touches_ends) << aspect;
    // The middle is exact if the sides touch, otherwise up to the line between two slopes
    // (camera_fit.h).
    EXPECT_NEAR(shown.center().x(), 0, 0.1);
    EXPECT_NEAR(shown.center().y(), 0, 0.1);
  }
}

TEST(CameraFitTest, LeavesRoomAtOneSide) {
  CameraFit fit(-Vector3d::UnitZ(), kFieldOfView_rad, 1, {.right = 0.2, .left = 0.9});
  fit.AddBall(Vector3d(-1, 0, 0), 0);
  fit.AddBall(Vector3d(1, 0, 0), 0);
  const Camera camera = fit.Fit(Vector3d::Zero());
  EXPECT_NEAR(Project(camera, 1, Vector3d(1, 0, 0)).x(), 0.2, 1e-9);
  EXPECT_NEAR(Project(camera, 1, Vector3d(-1, 0, 0)).x(), -0.9, 1e-9);
}

// The device's measures give the same camera as all points.
TEST(CameraFitTest, ReachesStandForPoints) {
  const std::vector<Vector3d> points = {{1, 2, 3}, {-1, 0.5, 2}, {0.3, 0.1, -4}};
  const Vector3d origin(10, 20, 30);
  CameraFit of_points(Vector3d(1, -1, 2), kFieldOfView_rad, 1.2, kShares);
  CameraFit of_reaches = of_points;
  Reaches reaches;
  for (size_t k = 0; k < reaches.size(); ++k) {
    reaches[k] = -1e9;
    for (const Vector3d& p : points) {
      reaches[k] = std::max(reaches[k], of_points.directions()[k].dot(p));
    }
  }
  of_reaches.AddReaches(origin, reaches, 0.05);
  for (const Vector3d& p : points) of_points.AddBall(p + origin, 0.05);
  EXPECT_NEAR((of_points.Fit(origin).eye_m - of_reaches.Fit(origin).eye_m).norm(), 0, 1e-9);
}

TEST(CameraFitTest, LooksDownLikeOnAMap) {
  CameraFit fit(Vector3d(0, -2, 0), kFieldOfView_rad, 1, kShares);
  fit.AddBall(Vector3d::Zero(), 1);
  const Camera camera = fit.Fit(Vector3d::Zero());
  EXPECT_EQ(camera.up, Vector3d(0, 0, -1));
  EXPECT_NEAR(camera.eye_m.x(), 0, 1e-12);
  EXPECT_GT(camera.eye_m.y(), 1);
}

TEST(CameraFitTest, FarFromTheOriginOfTheWorldIsTheSame) {
  const auto eye_of = [](const Vector3d& shift) {
    CameraFit fit(Vector3d(-1, -1, -1), kFieldOfView_rad, 1, kShares);
    fit.AddBall(shift + Vector3d(1, 0, 0), 0.1);
    fit.AddBall(shift + Vector3d(0, 1, 0), 0.2);
    return Vector3d(fit.Fit(shift).eye_m - shift);
  };
  // Round-off of doubles at 1e6 m: 1e-10 m, times 1 / slope of about 4, a few operations.
  EXPECT_NEAR((eye_of(Vector3d::Zero()) - eye_of(Vector3d(1e6, -1e6, 1e6))).norm(), 0, 1e-7);
}

}  // namespace
}  // namespace drape::render
