#include "server/scene/distance_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>

#include "server/scene/mesh_distance.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::shared_ptr<const DistanceMap> Map(const TriangleMesh& mesh, uint32_t resolution) {
  auto map = DistanceMap::Build(mesh, {.resolution = resolution});
  EXPECT_TRUE(map.ok()) << map.status().ToString();
  return map.value();
}

bool IsInside(const DistanceMap& map, const Vector3d& p) {
  return (p.array() >= map.low_m().array()).all() && (p.array() <= map.high_m().array()).all();
}

TriangleMesh UnitBox() {
  return BoxMesh(Vector3d::Constant(-0.5), Vector3d::Constant(0.5));
}

TEST(DistanceMapTest, TheGridHoldsTheMeshWithItsMargin) {
  const auto map = Map(BoxMesh({1, 2, 3}, {2, 2.5, 3.1}), 10);
  EXPECT_DOUBLE_EQ(map->cell_m(), 0.1);
  EXPECT_THAT(map->sample_counts(), testing::ElementsAre(17, 12, 8));
  EXPECT_THAT(map->samples_m(), SizeIs(17 * 12 * 8));
  EXPECT_NEAR((map->low_m() - Vector3d(0.7, 1.7, 2.7)).norm(), 0, 1e-12);
  EXPECT_NEAR((map->high_m() - Vector3d(2.3, 2.8, 3.4)).norm(), 0, 1e-12);
}

TEST(DistanceMapTest, IsTheExactDistanceAtItsSamples) {
  const TriangleMesh mesh = TorusMesh(1, 0.4, 12);
  const auto map = Map(mesh, 16);
  const MeshDistance exact(mesh);
  const auto [nx, ny, nz] = map->sample_counts();
  size_t index = 0;
  for (uint32_t k = 0; k < nz; ++k) {
    for (uint32_t j = 0; j < ny; ++j) {
      for (uint32_t i = 0; i < nx; ++i, ++index) {
        const Vector3d p = map->low_m() + map->cell_m() * Vector3d(i, j, k);
        EXPECT_EQ(map->samples_m()[index], static_cast<float>(exact.At(p).distance_m));
        // p is off its sample by rounding, which at a slope of 1 moves the distance as much.
        EXPECT_NEAR(map->DistanceAt(p), map->samples_m()[index], 1e-14);
      }
    }
  }
}

TEST(DistanceMapTest, KnowsHowDeepItIs) {
  const auto map = Map(BoxMesh({-1, -0.3, -2}, {1, 0.3, 2}), 40);
  EXPECT_LE(map->depth_m(), 0.3 + 1e-6);
  EXPECT_GE(map->depth_m(), 0.3 - map->cell_m() / 2);
}

// Near a flat face away from edges the distance is linear, which interpolation repeats.
TEST(DistanceMapTest, IsExactOverFlatFaces) {
  const auto map = Map(BoxMesh({-1, -0.5, -1}, {1, 0.5, 1}), 20);
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    const Vector3d p = PointInBox(random, {-0.5, 0.3, -0.5}, {0.5, 0.7, 0.5});
    const SurfaceDistance surface = map->SurfaceAt(p);
    EXPECT_NEAR(surface.distance_m, p.y() - 0.5, 1e-7);
    EXPECT_NEAR((surface.outward - Vector3d::UnitY()).norm(), 0, 1e-6);
  }
}

class DistanceMapBoundTest : public ::testing::TestWithParam<TriangleMesh> {};

TEST_P(DistanceMapBoundTest, InterpolationKeepsTheErrorBound) {
  const MeshDistance exact(GetParam());
  for (const uint32_t resolution : {8u, 33u}) {
    const auto map = Map(GetParam(), resolution);
    EXPECT_LT(map->error_bound_m(), 0.8661 * map->cell_m());
    for (const Vector3d& p : PointsAround(GetParam(), 2000, 3 * map->cell_m())) {
      if (!IsInside(*map, p)) continue;
      EXPECT_NEAR(map->DistanceAt(p), exact.At(p).distance_m, map->error_bound_m());
    }
  }
}

TEST_P(DistanceMapBoundTest, OutsideTheGridTheDistanceIsBoundedFromBothSides) {
  const auto map = Map(GetParam(), 12);
  const MeshDistance exact(GetParam());
  Random random(5);
  for (const double reach : {0.5, 5.0, 1e5}) {
    for (int k = 0; k < 500; ++k) {
      const Vector3d p = PointInBox(random, map->low_m() - Vector3d::Constant(reach),
                                    map->high_m() + Vector3d::Constant(reach));
      if (IsInside(*map, p)) continue;
      const double distance = map->DistanceAt(p);
      const double rounding = 1e-12 * reach;
      EXPECT_LE(distance, exact.At(p).distance_m + map->error_bound_m() + rounding);
      EXPECT_GE(std::numbers::sqrt2 * (distance + map->error_bound_m()) + rounding,
                exact.At(p).distance_m);
    }
  }
}

TEST_P(DistanceMapBoundTest, GoesOnBeyondTheGridWithoutAStep) {
  const auto map = Map(GetParam(), 12);
  Random random(6);
  for (int k = 0; k < 200; ++k) {
    Vector3d p = PointInBox(random, map->low_m(), map->high_m());
    const int axis = k % 3;
    for (const double side : {-1.0, 1.0}) {
      p[axis] = side < 0 ? map->low_m()[axis] : map->high_m()[axis];
      Vector3d beyond = p;
      beyond[axis] += side * 1e-7;
      EXPECT_NEAR(map->DistanceAt(beyond), map->DistanceAt(p), 2e-7);
    }
  }
}

TEST_P(DistanceMapBoundTest, TheNormalIsTheGradientOfTheDistance) {
  const auto map = Map(GetParam(), 10);
  Random random(7);
  const double step = 1e-6 * map->cell_m();
  const Vector3d around = Vector3d::Constant(5 * map->cell_m());
  int checked = 0;
  for (int k = 0; k < 1000; ++k) {
    const Vector3d p = PointInBox(random, map->low_m() - around, map->high_m() + around);
    const Vector3d in_cells = (p - map->low_m()) / map->cell_m();
    // The slope is another one on the far side of a cell's face.
    if (((in_cells - Vector3d(in_cells.array().round())).array().abs() < 1e-5).any()) continue;
    Vector3d difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d along = step * Vector3d::Unit(axis);
      difference[axis] = (map->DistanceAt(p + along) - map->DistanceAt(p - along)) / (2 * step);
    }
    const SurfaceDistance surface = map->SurfaceAt(p);
    EXPECT_EQ(surface.distance_m, map->DistanceAt(p));
    EXPECT_NEAR(surface.outward.norm(), 1, 1e-12);
    // Rounding of distances of some metres over the step, and per length of the gradient.
    const double tolerance = 4 * 2.2e-16 * (1 + p.norm()) / step;
    if (difference.norm() < 1e-3) continue;
    EXPECT_NEAR((surface.outward - difference.normalized()).norm(), 0,
                2 * tolerance / difference.norm() + 1e-5)
        << p.transpose();
    ++checked;
  }
  EXPECT_GT(checked, 900);
}

INSTANTIATE_TEST_SUITE_P(Meshes, DistanceMapBoundTest,
                         ::testing::Values(BoxMesh({-0.5, -0.5, -0.5}, {0.5, 0.7, 1}),
                                           SphereMesh(1, 3), TorusMesh(1, 0.3, 20),
                                           TetrahedronMesh(1), TetrahedronMesh(0.02)));

// A spike that ends in the middle of a cell is where the bound comes from: halving it would be
// wrong.
TEST(DistanceMapTest, ASpikeNearlyReachesTheErrorBound) {
  TriangleMesh spike = TetrahedronMesh(1);
  // Slender: the base around the point below the tip.
  for (int vertex = 0; vertex < 3; ++vertex) {
    spike.positions_m[vertex] =
        Vector3d(0.3, 0.3, 0) + 0.02 * (spike.positions_m[vertex] - Vector3d(0.3, 0.3, 0));
  }
  double worst = 0;
  for (const double length : {1.0, 0.98, 0.96, 0.94, 0.92, 0.9}) {
    spike.positions_m[3].z() = length;
    const auto map = Map(spike, 10);
    const MeshDistance exact(spike);
    for (const Vector3d& p : PointsAround(spike, 500, 0.1)) {
      const double error = std::abs(map->DistanceAt(p) - exact.At(p).distance_m);
      worst = std::max(worst, error / map->error_bound_m());
    }
  }
  EXPECT_GT(worst, 0.5);
  EXPECT_LE(worst, 1);
}

// Second order where the surface is smooth: at most 3/8 cell^2 over the distance from the centre,
// where the distance bends most, and what the facets are off the sphere.
TEST(DistanceMapTest, OfASphereTheErrorIsSecondOrderInTheCell) {
  const TriangleMesh mesh = SphereMesh(1, 4);
  const MeshDistance exact(mesh);
  for (const uint32_t resolution : {8u, 20u}) {
    const auto map = Map(mesh, resolution);
    const double cell = map->cell_m();
    for (const Vector3d& p : PointsAround(mesh, 1000, 0.2)) {
      if (p.norm() < 0.6 || !IsInside(*map, p)) continue;
      const double center_distance = p.norm() - std::numbers::sqrt3 * cell;  // of the whole cell
      EXPECT_NEAR(map->DistanceAt(p), exact.At(p).distance_m,
                  3.0 / 8 * cell * cell / center_distance + LargestSagitta(mesh, 1));
    }
  }
}

TEST(DistanceMapTest, WhereTheGradientVanishesTheNormalIsUp) {
  // By symmetry: with an odd number of cells the middle of the box is the middle of a cell.
  const auto map = Map(UnitBox(), 9);
  const SurfaceDistance center = map->SurfaceAt(Vector3d::Zero());
  EXPECT_EQ(center.outward, Vector3d::UnitY());
  EXPECT_NEAR(center.distance_m, -0.5, map->error_bound_m());
  EXPECT_NEAR((map->SurfaceAt({0.3, 0, 0}).outward - Vector3d::UnitX()).norm(), 0, 1e-6);
}

TEST(DistanceMapTest, AMemoryLimitCoarsensTheCells) {
  const auto fine = Map(UnitBox(), 100);
  EXPECT_GT(fine->samples_m().size(), 1'000'000u);
  const auto coarse =
      DistanceMap::Build(UnitBox(), {.resolution = 100, .max_samples = 10'000}).value();
  EXPECT_LE(coarse->samples_m().size(), 10'000u);
  EXPECT_GT(coarse->samples_m().size(), 5'000u);
  EXPECT_GT(coarse->cell_m(), fine->cell_m());
  EXPECT_NEAR(coarse->DistanceAt({0.6, 0.1, 0.1}), 0.1, coarse->error_bound_m());
  const auto coarsest = DistanceMap::Build(UnitBox(), {.resolution = 1024, .max_samples = 1024});
  EXPECT_LE(coarsest.value()->samples_m().size(), 1024u);
}

TEST(DistanceMapTest, RefusesSettingsOutOfRange) {
  const auto expect_refused = [](const DistanceMapSettings& settings, const std::string& text) {
    const auto map = DistanceMap::Build(UnitBox(), settings);
    EXPECT_EQ(map.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(map.status().message(), HasSubstr(text));
  };
  expect_refused({.resolution = 3}, "resolution: 3 is not in [4, 1024]");
  expect_refused({.resolution = 1025}, "resolution: 1025 is not in [4, 1024]");
  expect_refused({.max_samples = 1023}, "max_samples: 1023 is not in [1024, 268435456]");
  expect_refused({.max_samples = uint64_t{1} << 29}, "max_samples: 536870912 is not in");
}

TEST(DistanceMapTest, RefusesWhatIsNoSolid) {
  const auto expect_refused = [](const TriangleMesh& mesh, const std::string& text) {
    const auto map = DistanceMap::Build(mesh, {.resolution = 20});
    EXPECT_EQ(map.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(map.status().message(), HasSubstr(text));
  };
  TriangleMesh open = UnitBox();
  open.triangles.pop_back();
  expect_refused(open, "exactly 2 in a closed mesh");
  expect_refused(Reversed(UnitBox()), "inside out: it encloses -1 m^3");
  // Closed and of positive volume, but not the boundary of a solid.
  const TriangleMesh small = BoxMesh(Vector3d::Constant(-0.2), Vector3d::Constant(0.2));
  const std::string contradiction = "inside and outside contradict each other near (";
  expect_refused(Join(UnitBox(), small), contradiction);
  expect_refused(Join(UnitBox(), Reversed(Moved(small, {0.9, 0, 0}))), contradiction);
  expect_refused(Join(UnitBox(), Moved(UnitBox(), {0.4, 0.4, 0.4})), contradiction);
  EXPECT_TRUE(DistanceMap::Build(Join(UnitBox(), Reversed(small)), {.resolution = 20}).ok());
}

TEST(DistanceMapTest, FarFromTheOriginItIsTheSameMap) {
  const Vector3d offset(1000, -2000, 500);
  const auto near = Map(TorusMesh(1, 0.3, 16), 16);
  const auto far = Map(Moved(TorusMesh(1, 0.3, 16), offset), 16);
  ASSERT_EQ(near->sample_counts(), far->sample_counts());
  for (size_t k = 0; k < near->samples_m().size(); ++k) {
    EXPECT_NEAR(near->samples_m()[k], far->samples_m()[k], 1e-6);
  }
}

TEST(DistanceMapTest, NotANumberStaysOne) {
  const auto map = Map(UnitBox(), 8);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(map->DistanceAt({0, nan, 0})));
  EXPECT_TRUE(std::isnan(map->SurfaceAt({nan, nan, nan}).distance_m));
  EXPECT_GT(map->DistanceAt({1e300, 0, 0}), 1e299);
}

TEST(DistanceMapTest, EqualContentGivesEqualMapsAndHashes) {
  const TriangleMesh mesh = TorusMesh(1, 0.3, 16);
  const auto a = Map(mesh, 16);
  const auto b = Map(mesh, 16);
  ASSERT_EQ(a->samples_m().size(), b->samples_m().size());
  EXPECT_EQ(std::memcmp(a->samples_m().data(), b->samples_m().data(), a->samples_m().size_bytes()),
            0);
  EXPECT_TRUE(SameContent(a->mesh(), mesh));

  const uint64_t hash = DistanceMapHash(mesh, {});
  EXPECT_EQ(DistanceMapHash(TriangleMesh(mesh), {}), hash);
  TriangleMesh other = mesh;
  other.positions_m[5].z() = std::nextafter(other.positions_m[5].z(), 1.0);
  EXPECT_NE(DistanceMapHash(other, {}), hash);
  EXPECT_FALSE(SameContent(other, mesh));
  other = mesh;
  std::swap(other.triangles[0], other.triangles[1]);
  EXPECT_NE(DistanceMapHash(other, {}), hash);
  EXPECT_FALSE(SameContent(other, mesh));
  EXPECT_NE(DistanceMapHash(mesh, {.resolution = 127}), hash);
  EXPECT_NE(DistanceMapHash(mesh, {.max_samples = 1u << 20}), hash);
}

}  // namespace
}  // namespace drape::test
