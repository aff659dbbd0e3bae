#include "server/render/gl_draw/projection.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace drape::render {

using Eigen::Matrix4d;
using Eigen::Vector3d;

CameraAxes AxesOf(const Camera& camera) {
  const Vector3d forward = (camera.target_m - camera.eye_m).normalized();
  const Vector3d right = forward.cross(camera.up).normalized();
  return {.right = right, .up = right.cross(forward), .forward = forward};
}

Matrix4d ClipFromEye(const Camera& camera, double aspect, double near_m) {
  const CameraAxes axes = AxesOf(camera);
  const double scale = 1 / std::tan(camera.vertical_field_of_view_rad / 2);
  Matrix4d clip = Matrix4d::Zero();
  clip.block<1, 3>(0, 0) = scale / aspect * axes.right.transpose();
  clip.block<1, 3>(1, 0) = scale * axes.up.transpose();
  clip(2, 3) = near_m;
  clip.block<1, 3>(3, 0) = axes.forward.transpose();
  return clip;
}

Vector3d DirectionToKeyLight(const Camera& camera) {
  const CameraAxes axes = AxesOf(camera);
  // Horizontal, towards the viewer; looking straight down or up, the picture's lower edge.
  Vector3d toward = -axes.forward;
  toward.y() = 0;
  if (toward.norm() < 1e-3) toward = Vector3d(-axes.up.x(), 0, -axes.up.z());
  if (toward.norm() < 1e-3) toward = Vector3d::UnitZ();
  toward.normalize();
  Vector3d right(axes.right.x(), 0, axes.right.z());
  if (right.norm() < 1e-3) right = Vector3d::UnitX();
  right.normalize();
  return (Vector3d::UnitY() - 0.55 * right + 0.6 * toward).normalized();
}

ShadowView FitShadow(std::span<const Eigen::AlignedBox3d> casters, const Vector3d& eye_m,
                     const Vector3d& to_light) {
  const Vector3d hint = std::abs(to_light.y()) < 0.9 ? Vector3d::UnitY() : Vector3d::UnitX();
  const Vector3d right = hint.cross(to_light).normalized();
  const Vector3d up = to_light.cross(right);
  Eigen::AlignedBox3d box;  // in the axes of the light
  for (const Eigen::AlignedBox3d& caster : casters) {
    for (int index = 0; index < 8; ++index) {
      const Vector3d corner =
          caster.corner(static_cast<Eigen::AlignedBox3d::CornerType>(index)) - eye_m;
      box.extend(Vector3d(right.dot(corner), up.dot(corner), -to_light.dot(corner)));
    }
  }
  // Slightly larger, for the taps of the filter.
  const double width = 1.04 * std::max({box.sizes().x(), box.sizes().y(), 1e-6});
  const double depth = 1.04 * std::max(box.sizes().z(), 1e-6);
  const Vector3d center = box.center();

  ShadowView view;
  view.width_m = width;
  Matrix4d& clip = view.clip_from_eye;
  clip.setIdentity();
  clip.block<1, 3>(0, 0) = 2 / width * right.transpose();
  clip.block<1, 3>(1, 0) = 2 / width * up.transpose();
  clip.block<1, 3>(2, 0) = -1 / depth * to_light.transpose();
  clip(0, 3) = -2 / width * center.x();
  clip(1, 3) = -2 / width * center.y();
  clip(2, 3) = 0.5 - center.z() / depth;
  Matrix4d texture_from_clip = Matrix4d::Identity();
  texture_from_clip(0, 0) = texture_from_clip(1, 1) = 0.5;
  texture_from_clip(0, 3) = texture_from_clip(1, 3) = 0.5;
  view.texture_from_eye = texture_from_clip * clip;
  return view;
}

shader::mat4 ToShader(const Matrix4d& matrix) {
  const Eigen::Matrix4f single = matrix.cast<float>();
  shader::mat4 result;
  std::memcpy(result.elements, single.data(), sizeof(result.elements));
  return result;
}

shader::vec4 ToShader(const Vector3d& vector, double w) {
  return {static_cast<float>(vector.x()), static_cast<float>(vector.y()),
          static_cast<float>(vector.z()), static_cast<float>(w)};
}

}  // namespace drape::render
