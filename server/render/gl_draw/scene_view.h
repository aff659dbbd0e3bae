// How a picture looks at what is in it. Pure.
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
  double near_m = 0;             // of the projection
  shader::DrawFrame frame;       // of the picture
  shader::DrawFrame shadow_frame;
};

// What a fitted camera looks for: along the view direction of the spec, beside the legend.
CameraFit StartFit(const PictureSpec& spec);

// `fit`: what StartFit gave and the measures were made with. Shadow maps are `shadow_size_px` wide.
// With no finite particle the picture shows the box asked for, or else the place where the first
// cloth has its origin.
SceneView LookAt(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                 const ClothMeasures& measures, const ColliderShapes& shapes, CameraFit fit,
                 uint32_t shadow_size_px);

// The ends of the colour scale: those asked for, else of the values; for strain symmetric about 0.
// At least 2e-4 (strain) or 1e-3 m/s wide, so that round-off is not painted in full colours. 0, 0
// without a scale.
ValueRange ScaleRange(const PictureSpec& spec, const ValueRange& values);

}  // namespace drape::render
