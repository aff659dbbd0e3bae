#include "server/render/gl_draw/solid_faces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

DrawnSolid Ball(double radius_m) {
  DrawnSolid solid;
  solid.radius_m = solid.drawn_radius_m = radius_m;
  return solid;
}

TEST(SolidFacesTest, FacesAreWithinAFifthOfAPixel) {
  const Camera camera = FrontCamera(Eigen::Vector3d::Zero(), 10, 1);
  for (const uint32_t height_px : {16u, 64u, 240u, 960u}) {
    for (const double radius_m : {0.01, 0.1, 0.4}) {
      const double around = 4.0 * QuarterFaces(Ball(radius_m), 1, camera, height_px);
      // Of the circle in which its outline is seen.
      const double radius_px = height_px * 10 * std::tan(std::asin(radius_m / 10)) / 1;
      EXPECT_LE(radius_px * (1 - std::cos(std::numbers::pi / around)), 0.2)
          << radius_m << " m, " << height_px << " px";
    }
  }
  // Not more than that takes: 3.1 px, a chord of a twelfth is 0.1 px inside, one of an eighth 0.24.
  EXPECT_EQ(QuarterFaces(Ball(0.048), 1, camera, 64), 3u);
}

TEST(SolidFacesTest, CuboidsHaveTheirFacesAndManySolidsFewerEach) {
  const Camera camera = FrontCamera(Eigen::Vector3d::Zero(), 10, 1);
  EXPECT_EQ(QuarterFaces(Ball(0), 1, camera, 4096), 1u);
  EXPECT_EQ(QuarterFaces(Ball(0.5), 8, camera, 4096), 48u);
  EXPECT_EQ(QuarterFaces(Ball(0.5), 9, camera, 4096), 24u);
  EXPECT_EQ(QuarterFaces(Ball(0.5), 65, camera, 4096), 12u);
  // The eye is in it.
  EXPECT_EQ(QuarterFaces(Ball(20), 1, camera, 64), 48u);
}

// Each edge once in each direction, poles aside, whose vertices are many.
TEST(SolidFacesTest, TrianglesCloseAroundTheSolid) {
  for (const uint32_t quarter : {1u, 3u, 12u}) {
    const std::vector<uint32_t> indices = SolidIndices(quarter);
    const uint32_t columns = 4 * (quarter + 1), rows = 2 * quarter + 3;
    ASSERT_EQ(indices.size(), size_t{6} * columns * rows);
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    for (size_t k = 0; k < indices.size(); k += 3) {
      for (size_t corner = 0; corner < 3; ++corner) {
        ++edges[{indices[k + corner], indices[k + (corner + 1) % 3]}];
      }
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      const bool is_pole = std::max(edge.first, edge.second) < columns ||
                           std::min(edge.first, edge.second) >= rows * columns;
      EXPECT_EQ(edges.contains({edge.second, edge.first}), !is_pole);
    }
  }
}

}  // namespace
}  // namespace drape::render
