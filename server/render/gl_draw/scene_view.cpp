#include "server/render/gl_draw/scene_view.h"

#include <algorithm>
#include <cmath>

#include "server/render/gl_draw/legend.h"
#include "server/render/gl_draw/projection.h"

namespace drape::render {

namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// Share of the picture's width and height that a fitted camera fills.
constexpr double kFill = 0.85;
constexpr double kFieldOfView_rad = 0.6;

AlignedBox3d BoxAround(const DrawnSolid& solid) {
  AlignedBox3d box;
  for (const Vector3d& corner : CornersOf(solid)) box.extend(corner);
  const Vector3d margin = Vector3d::Constant(solid.radius_m);
  return {box.min() - margin, box.max() + margin};
}

void AddCorners(const AlignedBox3d& box, CameraFit& fit) {
  if (box.isEmpty()) return;
  for (int corner = 0; corner < 8; ++corner) {
    fit.AddBall(box.corner(static_cast<AlignedBox3d::CornerType>(corner)), 0);
  }
}

double AspectOf(const PictureSpec& spec) {
  return static_cast<double>(spec.width_px) / spec.height_px;
}

void FillFrames(const PictureSpec& spec, std::span<const AlignedBox3d> casters,
                uint32_t shadow_size_px, SceneView& view) {
  const Camera& camera = view.camera;
  const double width = spec.width_px;
  const double height = spec.height_px;
  const Vector3d to_light = DirectionToKeyLight(camera);
  const ShadowView shadow = FitShadow(casters, camera.eye_m, to_light);
  const double texel_m = shadow.width_m / shadow_size_px;
  const double pixel = 2 * std::tan(camera.vertical_field_of_view_rad / 2) / height;
  const double span = view.range.high - view.range.low;

  shader::DrawFrame& frame = view.frame;
  frame.clip_from_world = ToShader(ClipFromEye(camera, AspectOf(spec), view.near_m));
  frame.shadow_from_world = ToShader(shadow.texture_from_eye);
  frame.viewer = ToShader(Vector3d::Zero(), 1);
  frame.to_light = ToShader(to_light, texel_m);
  frame.screen = {static_cast<float>(width), static_cast<float>(height), static_cast<float>(pixel),
                  1 / static_cast<float>(shadow_size_px)};
  frame.shadow_cell = {0, 0, 1, 1};
  frame.scale = {static_cast<float>(view.range.low), span > 0 ? static_cast<float>(1 / span) : 0.0f,
                 static_cast<float>(view.radius_m), static_cast<float>(view.near_m)};
  view.shadow_frame = frame;
  view.shadow_frame.clip_from_world = ToShader(shadow.clip_from_eye);
  view.shadow_frame.viewer = ToShader(to_light, 0);
  view.shadow_frame.screen.z = static_cast<float>(texel_m);
}

}  // namespace

void SceneView::PlaceShadow(const shader::vec4& cell, uint32_t map_size_px) {
  for (shader::DrawFrame* seen : {&frame, &shadow_frame}) {
    seen->shadow_cell = cell;
    seen->screen.w = 1 / static_cast<float>(map_size_px);
  }
}

ValueRange ScaleRange(const PictureSpec& spec, const ValueRange& values) {
  constexpr double kLeastStrain = 1e-4;
  constexpr double kLeastSpeed_m_per_s = 1e-3;
  constexpr double kLeastForce_n = 1e-6;
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
    case Colouring::kContact:
      if (spec.range) return *spec.range;
      return {0, std::max(values.high, kLeastForce_n)};
  }
  return {};
}

CameraFit StartFit(const PictureSpec& spec) {
  FitShares shares{.right = kFill, .left = kFill, .up = kFill, .down = kFill};
  if (spec.has_legend && spec.colouring != Colouring::kMaterial) {
    shares.right = std::min(kFill, 1 - 2 * LegendWidth(spec) / spec.width_px);
  }
  return CameraFit(spec.view_direction, kFieldOfView_rad, AspectOf(spec), shares);
}

SceneView LookAt(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                 const ClothMeasures& measures, const ColliderShapes& shapes, CameraFit fit,
                 uint32_t shadow_size_px) {
  SceneView view;
  view.bounds_m = spec.include_m;
  AlignedBox3d content;  // cloths and the solids near them
  std::vector<AlignedBox3d> casters;
  for (const ClothMeasures::Cloth& cloth : measures.cloths) {
    view.bounds_m.extend(cloth.box_m);
    content.extend(cloth.box_m);
    casters.push_back(cloth.box_m);
    fit.AddReaches(cloth.origin_m, cloth.reaches_m, cloth.margin_m);
  }
  if (spec.has_colliders && !content.isEmpty()) {
    const AlignedBox3d cloth_bounds = content;
    for (const DrawnSolid& solid : shapes.solids) {
      if (!IsNear(solid, cloth_bounds)) continue;
      content.extend(BoxAround(solid));
      casters.push_back(BoxAround(solid));
      for (const Vector3d& corner : CornersOf(solid)) fit.AddBall(corner, solid.radius_m);
    }
  }
  if (view.bounds_m.isEmpty()) {
    view.bounds_m.extend(cloths.empty() ? Vector3d(Vector3d::Zero())
                                        : cloths[0].placement.WorldFromCloth(Vector3d::Zero()));
    fit.AddBall(view.bounds_m.center(), 0.1);
  }
  if (content.isEmpty()) content = view.bounds_m;
  if (casters.empty()) casters.push_back(content);
  AddCorners(spec.include_m, fit);
  view.range = ScaleRange(spec, measures.values);
  view.center_m = content.center();
  view.radius_m = std::max(content.diagonal().norm() / 2, 1e-6);
  view.camera = spec.camera ? *spec.camera : fit.Fit(view.center_m);
  view.floor_center_m = view.center_m;
  view.floor_radius_m = view.radius_m;
  if (spec.camera) {
    view.floor_center_m = view.camera.target_m;
    view.floor_radius_m = (view.camera.target_m - view.camera.eye_m).norm() *
                          std::tan(view.camera.vertical_field_of_view_rad / 2);
  }
  // The depth keeps its precision however near this is (ClipFromEye).
  const double distance = (view.camera.eye_m - view.center_m).norm();
  view.near_m = 1e-3 * std::max(distance - view.radius_m, 0.01 * view.radius_m);
  FillFrames(spec, casters, shadow_size_px, view);
  return view;
}

}  // namespace drape::render
