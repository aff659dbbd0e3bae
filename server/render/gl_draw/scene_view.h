// The view of a picture. Pure.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "server/render/gl_draw/camera_fit.h"
#include "server/render/gl_draw/cloth_set.h"
#include "server/render/gl_draw/collider_shapes.h"
#include "server/render/picture_spec.h"
#include "shaders/interface/draw_records.h"

namespace drape::render {

// World frame.
struct SceneView {
  Camera camera;                 // given or fitted
  Eigen::AlignedBox3d bounds_m;  // as in Picture
  ValueRange range;              // as in Picture
  double radius_m = 1;           // of a ball around the cloths and the solids near them
  Eigen::Vector3d center_m;      // of that ball
  // What planes are drawn around, and how wide: that ball, or with a given camera what it sees, so
  // that a film of cloth that moves has a floor that does not.
  Eigen::Vector3d floor_center_m;
  double floor_radius_m = 1;
  double near_m = 0;        // of the projection
  shader::DrawFrame frame;  // of the picture
  shader::DrawFrame shadow_frame;

  // The shadow map is this part of a larger one: origin (xy) and size (zw).
  void PlaceShadow(const shader::vec4& cell, uint32_t map_size_px);
};

// The camera fit of the spec: along its view direction, beside the legend.
CameraFit StartFit(const PictureSpec& spec);

// `fit`: from StartFit, as used for the measures. Shadow maps are `shadow_size_px` wide. Without a
// finite particle the picture shows the requested box or, without one, the origin of the first
// cloth.
SceneView LookAt(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                 const ClothMeasures& measures, const ColliderShapes& shapes, CameraFit fit,
                 uint32_t shadow_size_px);

// The ends of the colour scale: those requested, otherwise those of the values; for strain
// symmetric about 0. At least 2e-4 (strain) or 1e-3 m/s wide, so that round-off does not show in
// full colours. 0, 0 without a scale.
ValueRange ScaleRange(const PictureSpec& spec, const ValueRange& values);

}  // namespace drape::render
