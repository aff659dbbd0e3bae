// From the world into the picture and into the shadow map. Pure. Everything is in world axes with
// the origin at the eye, so that it stays exact in single precision however far the eye is from the
// origin of the world.
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

// Perspective without a far end; depth 1 at `near_m`, 0 infinitely far away (with floats that keeps
// the precision relative to the distance). `aspect`: width / height.
Eigen::Matrix4d ClipFromEye(const Camera& camera, double aspect, double near_m);

// Unit, towards the light that casts the shadows: from above, from the left of the camera.
Eigen::Vector3d DirectionToKeyLight(const Camera& camera);

// How the key light sees the scene, without perspective.
struct ShadowView {
  Eigen::Matrix4d clip_from_eye;     // depth 0 at the near end
  Eigen::Matrix4d texture_from_eye;  // the same as coordinates of the map
  double width_m = 0;                // of the whole map
};
// Around boxes of the world, at least one.
ShadowView FitShadow(std::span<const Eigen::AlignedBox3d> casters, const Eigen::Vector3d& eye_m,
                     const Eigen::Vector3d& to_light);

shader::mat4 ToShader(const Eigen::Matrix4d& matrix);
shader::vec4 ToShader(const Eigen::Vector3d& vector, double w);

}  // namespace drape::render
