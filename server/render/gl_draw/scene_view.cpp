#include "server/render/gl_draw/scene_view.h"

#include <algorithm>
#include <cmath>

#include "server/render/gl_draw/camera_fit.h"
#include "server/render/gl_draw/projection.h"

namespace drape::render {

namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// Share of the picture's width and height that a fitted camera fills.
constexpr double kFill = 0.85;

void AddCorners(const AlignedBox3d& box, double margin_m, std::vector<FitBall>& balls) {
  if (box.isEmpty()) return;
  for (int corner = 0; corner < 8; ++corner) {
    balls.push_back({box.corner(static_cast<AlignedBox3d::CornerType>(corner)), margin_m});
  }
}

// What must be in the picture: around each cloth a margin for lines, balls and pins.
std::vector<FitBall> Content(const ClothMeasures& measures, const ColliderShapes& shapes,
                             const AlignedBox3d& cloth_bounds, bool has_colliders) {
  std::vector<FitBall> balls;
  for (const ClothMeasures::Bounds& bounds : measures.bounds) {
    AddCorners(bounds.box_m, 0.1 * bounds.length_scale_m, balls);
  }
  if (!has_colliders || cloth_bounds.isEmpty()) return balls;
  for (const DrawnSphere& sphere : shapes.spheres) {
    if (IsNear(sphere, cloth_bounds)) balls.push_back({sphere.center_m, sphere.radius_m});
  }
  return balls;
}

AlignedBox3d BoxAround(std::span<const FitBall> balls) {
  AlignedBox3d box;
  for (const FitBall& ball : balls) {
    box.extend(Vector3d(ball.center_m - Vector3d::Constant(ball.radius_m)));
    box.extend(Vector3d(ball.center_m + Vector3d::Constant(ball.radius_m)));
  }
  return box;
}

void FillFrames(const PictureSpec& spec, std::span<const FitBall> content, uint32_t shadow_size_px,
                SceneView& view) {
  const Camera& camera = view.camera;
  const double width = spec.width_px;
  const double height = spec.height_px;
  const Vector3d to_light = DirectionToKeyLight(camera);
  std::vector<ShadowCaster> casters;
  for (const FitBall& ball : content) {
    casters.push_back({ball.center_m - camera.eye_m, ball.radius_m});
  }
  const ShadowView shadow = FitShadow(casters, to_light);
  const double texel_m = shadow.width_m / shadow_size_px;
  const double pixel = 2 * std::tan(camera.vertical_field_of_view_rad / 2) / height;
  const double span = view.range.high - view.range.low;

  shader::DrawFrame& frame = view.frame;
  frame.clip_from_world = ToShader(ClipFromEye(camera, width / height, view.near_m));
  frame.shadow_from_world = ToShader(shadow.texture_from_eye);
  frame.viewer = ToShader(Vector3d::Zero(), 1);
  frame.to_light = ToShader(to_light, texel_m);
  frame.screen = {static_cast<float>(width), static_cast<float>(height), static_cast<float>(pixel),
                  1 / static_cast<float>(shadow_size_px)};
  frame.scale = {static_cast<float>(view.range.low), span > 0 ? static_cast<float>(1 / span) : 0.0f,
                 static_cast<float>(view.radius_m), 0};
  view.shadow_frame = frame;
  view.shadow_frame.clip_from_world = ToShader(shadow.clip_from_eye);
  view.shadow_frame.viewer = ToShader(to_light, 0);
  view.shadow_frame.screen.z = static_cast<float>(texel_m);
}

}  // namespace

ValueRange ScaleRange(const PictureSpec& spec, const ValueRange& values) {
  constexpr double kLeastStrain = 1e-4;
  constexpr double kLeastSpeed_m_per_s = 1e-3;
  switch (spec.colouring) {
    case Colouring::kMaterial:
    case Colouring::kColourGroup:
      return {};
    case Colouring::kStrain: {
      if (spec.range) return *spec.range;
      const double largest = std::max({std::abs(values.low), std::abs(values.high), kLeastStrain});
      return {-largest, largest};
    }
    case Colouring::kSpeed:
      if (spec.range) return *spec.range;
      return {values.low, std::max(values.high, values.low + kLeastSpeed_m_per_s)};
  }
  return {};
}

SceneView LookAt(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                 const ClothMeasures& measures, const ColliderShapes& shapes,
                 uint32_t shadow_size_px) {
  SceneView view;
  AlignedBox3d cloth_bounds;
  for (const ClothMeasures::Bounds& bounds : measures.bounds) cloth_bounds.extend(bounds.box_m);
  view.bounds_m = cloth_bounds.merged(spec.include_m);
  if (view.bounds_m.isEmpty()) {
    view.bounds_m.extend(cloths.empty() ? Vector3d(Vector3d::Zero())
                                        : cloths[0].placement.WorldFromCloth(Vector3d::Zero()));
  }
  view.range = ScaleRange(spec, measures.values);

  std::vector<FitBall> content = Content(measures, shapes, cloth_bounds, spec.has_colliders);
  if (content.empty()) AddCorners(view.bounds_m, 0.1, content);
  const AlignedBox3d box = BoxAround(content);
  view.center_m = box.center();
  view.radius_m = std::max(box.diagonal().norm() / 2, 1e-6);

  std::vector<FitBall> shown = content;
  AddCorners(spec.include_m, 0, shown);
  constexpr double kFieldOfView_rad = 0.6;
  const double aspect = static_cast<double>(spec.width_px) / spec.height_px;
  view.camera = spec.camera
                    ? *spec.camera
                    : FitCamera(shown, spec.view_direction, kFieldOfView_rad, aspect, kFill);
  // The depth keeps its precision however near this is (ClipFromEye).
  const double distance = (view.camera.eye_m - view.center_m).norm();
  view.near_m = 1e-3 * std::max(distance - view.radius_m, 0.01 * view.radius_m);
  FillFrames(spec, content, shadow_size_px, view);
  return view;
}

}  // namespace drape::render
