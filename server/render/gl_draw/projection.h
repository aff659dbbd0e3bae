// Projections from the world into the picture and the shadow map. Pure. All coordinates are in
// world axes with the origin at the eye, so that single precision is enough however far the eye is
// from the world's origin.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "server/render/picture_spec.h"
#include "shaders/interface/types.h"

namespace drape::render {

// Unit axes of a camera, in the world.
struct CameraAxes {
  Eigen::Vector3d right;
  Eigen::Vector3d up;
  Eigen::Vector3d forward;
};
CameraAxes AxesOf(const Camera& camera);

// Perspective without a far plane: depth 1 at `near_m`, 0 at infinity (with floats, precision is
// then relative to the distance). `aspect`: width / height.
Eigen::Matrix4d ClipFromEye(const Camera& camera, double aspect, double near_m);

// Unit vector towards the light that casts shadows: above and to the left of the camera.
Eigen::Vector3d DirectionToKeyLight(const Camera& camera);

// The key light's view of the scene, without perspective.
struct ShadowView {
  Eigen::Matrix4d clip_from_eye;     // depth 0 at the near end
  Eigen::Matrix4d texture_from_eye;  // coordinates of the map
  double width_m = 0;                // width of the whole map
};
// Encloses boxes of the world, at least one.
ShadowView FitShadow(std::span<const Eigen::AlignedBox3d> casters, const Eigen::Vector3d& eye_m,
                     const Eigen::Vector3d& to_light);

shader::mat4 ToShader(const Eigen::Matrix4d& matrix);
shader::vec4 ToShader(const Eigen::Vector3d& vector, double w);

}  // namespace drape::render
