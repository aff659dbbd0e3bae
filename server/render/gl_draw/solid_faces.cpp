#include "server/render/gl_draw/solid_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/render/gl_draw/projection.h"

namespace drape::render {

namespace {

// The numbers of faces that are used: a page has few different ones.
constexpr std::array<uint32_t, 11> kQuarters = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48};
// How far the middle of a face may be inside the solid [px]: less than the distance of two samples.
// Larger, outlines have corners; smaller, most of the time of a small picture of a ball is that of
// its faces.
constexpr double kMaxSag_px = 0.2;

// Of the outline of its nearest ball; infinity: the eye is in it or beside it. A ball of radius r
// at the distance d is seen as one of r / sqrt(d^2 - r^2) at 1 m, drawn out away from the middle of
// the picture.
double RadiusPixels(const DrawnSolid& solid, const Camera& camera, uint32_t height_px) {
  const Eigen::Vector3d toward = solid.center_m - camera.eye_m;
  const double depth_m = AxesOf(camera).forward.dot(toward) - solid.half_extents_m.norm();
  if (depth_m <= solid.radius_m) return std::numeric_limits<double>::infinity();
  const double pixel = 2 * std::tan(camera.vertical_field_of_view_rad / 2) / height_px;
  const double at_1_m =
      solid.drawn_radius_m / std::sqrt(depth_m * depth_m - solid.radius_m * solid.radius_m);
  return at_1_m * std::max(toward.norm() / depth_m, 1.0) / pixel;
}

}  // namespace

// A chord of a circle of radius r over the angle 2 pi / n is r (1 - cos(pi / n)), about r pi^2 / (2
// n^2), inside it.
uint32_t QuarterFaces(const DrawnSolid& solid, size_t solid_count, const Camera& camera,
                      uint32_t height_px) {
  if (solid.drawn_radius_m == 0) return 1;
  const uint32_t most = solid_count <= 8 ? 48 : solid_count <= 64 ? 24 : 12;
  const double wanted =
      std::numbers::pi * std::sqrt(RadiusPixels(solid, camera, height_px) / (2 * kMaxSag_px)) / 4;
  const auto enough = std::find_if(kQuarters.begin(), kQuarters.end(),
                                   [wanted](uint32_t faces) { return faces >= wanted; });
  return enough == kQuarters.end() ? most : std::min(most, *enough);
}

std::vector<uint32_t> SolidIndices(uint32_t quarter_faces) {
  const uint32_t columns = 4 * (quarter_faces + 1);
  const uint32_t rows = 2 * quarter_faces + 3;
  std::vector<uint32_t> indices;
  indices.reserve(size_t{6} * columns * rows);
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t column = 0; column < columns; ++column) {
      const uint32_t upper = row * columns, lower = upper + columns;
      const uint32_t left = column, right = (column + 1) % columns;
      for (const uint32_t vertex : {upper + left, lower + left, lower + right, upper + left,
                                    lower + right, upper + right}) {
        indices.push_back(vertex);
      }
    }
  }
  return indices;
}

}  // namespace drape::render
