#include "server/render/gl_draw/projection.h"

#include <gtest/gtest.h>

#include <cmath>

namespace drape::render {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

const Camera kCamera{.eye_m = {1, 2, 3},
                     .target_m = {-2, 1, -4},
                     .up = {0, 3, 0},
                     .vertical_field_of_view_rad = 0.8};

TEST(ProjectionTest, AxesAreRightHandedAndUnit) {
  const CameraAxes axes = AxesOf(kCamera);
  for (const Vector3d& axis : {axes.right, axes.up, axes.forward}) {
    EXPECT_NEAR(axis.norm(), 1, 1e-12);
  }
  EXPECT_NEAR((axes.right.cross(axes.up) + axes.forward).norm(), 0, 1e-12);
  EXPECT_NEAR(axes.right.y(), 0, 1e-12);
  EXPECT_GT(axes.up.y(), 0);
}

TEST(ProjectionTest, TheTargetIsTheCentreAndTheFieldOfViewTheEdge) {
  constexpr double kAspect = 1.6;
  constexpr double kNear_m = 0.25;
  const Eigen::Matrix4d clip = ClipFromEye(kCamera, kAspect, kNear_m);
  const CameraAxes axes = AxesOf(kCamera);
  const Vector3d to_target = kCamera.target_m - kCamera.eye_m;
  const Vector4d target = clip * to_target.homogeneous();
  EXPECT_NEAR(target.x(), 0, 1e-9);
  EXPECT_NEAR(target.y(), 0, 1e-9);
  EXPECT_NEAR(target.w(), to_target.norm(), 1e-9);
  const double slope = std::tan(kCamera.vertical_field_of_view_rad / 2);
  const Vector3d corner = axes.forward + slope * axes.up + kAspect * slope * axes.right;
  const Vector4d edge = clip * corner.homogeneous();
  EXPECT_NEAR(edge.x() / edge.w(), 1, 1e-12);
  EXPECT_NEAR(edge.y() / edge.w(), 1, 1e-12);
  // Depth 1 at the near end, then falling as near / distance.
  EXPECT_NEAR((clip * Vector3d(kNear_m * axes.forward).homogeneous()).z(), kNear_m, 1e-12);
  const Vector4d far = clip * Vector3d(100 * axes.forward).homogeneous();
  EXPECT_NEAR(far.z() / far.w(), kNear_m / 100, 1e-12);
}

TEST(ProjectionTest, LightComesFromAboveAndTheViewersSide) {
  for (const Vector3d& view :
       {Vector3d(0, 0, -1), Vector3d(-0.55, -0.42, -0.72), Vector3d(1, 2, 0)}) {
    Camera camera = kCamera;
    camera.target_m = camera.eye_m + view;
    const Vector3d to_light = DirectionToKeyLight(camera);
    EXPECT_NEAR(to_light.norm(), 1, 1e-12);
    EXPECT_GT(to_light.y(), 0.5);
    EXPECT_LT(to_light.dot(AxesOf(camera).right), 0);
    EXPECT_GT(to_light.dot(Vector3d(-view.x(), 0, -view.z())), 0);
  }
  Camera down = kCamera;
  down.target_m = down.eye_m - Vector3d::UnitY();
  down.up = -Vector3d::UnitZ();
  EXPECT_TRUE(DirectionToKeyLight(down).allFinite());
}

TEST(ProjectionTest, ShadowMapHoldsAllBoxes) {
  const Vector3d eye(1e6, 0, 0);
  const std::vector<AlignedBox3d> boxes = {{Vector3d(1e6, 0, 0), Vector3d(1e6 + 1, 2, 3)},
                                           {Vector3d(1e6 - 4, 1, 1), Vector3d(1e6 - 3, 2, 2)}};
  for (const Vector3d& to_light : {Vector3d(0, 1, 0), Vector3d(-0.3, 0.8, 0.5)}) {
    const ShadowView view = FitShadow(boxes, eye, to_light.normalized());
    for (const AlignedBox3d& box : boxes) {
      for (int k = 0; k < 8; ++k) {
        const Vector3d corner = box.corner(static_cast<AlignedBox3d::CornerType>(k)) - eye;
        const Vector4d clip = view.clip_from_eye * corner.homogeneous();
        EXPECT_LE(clip.head<2>().cwiseAbs().maxCoeff(), 1);
        EXPECT_GE(clip.z(), 0);
        EXPECT_LE(clip.z(), 1);
        // Towards the light the depth falls, by 1 / the depth of the box.
        const Vector4d nearer =
            view.clip_from_eye * Vector3d(corner + 0.1 * to_light.normalized()).homogeneous();
        EXPECT_LT(nearer.z(), clip.z());
        EXPECT_NEAR((nearer - clip).head<2>().norm(), 0, 1e-9);
        const Vector4d texture = view.texture_from_eye * corner.homogeneous();
        EXPECT_NEAR(texture.x(), 0.5 + 0.5 * clip.x(), 1e-12);
        EXPECT_NEAR(texture.z(), clip.z(), 1e-12);
      }
    }
    EXPECT_GE(view.width_m, 4);
  }
}

TEST(ProjectionTest, ColumnsComeFirst) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix(1, 3) = 7;
  EXPECT_EQ(ToShader(matrix).elements[13], 7.0f);
}

}  // namespace
}  // namespace drape::render
