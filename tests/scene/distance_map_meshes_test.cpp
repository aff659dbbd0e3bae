// Distance maps of the real meshes: against exact distances, and how long they take to build.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <iostream>
#include <string>

#include "server/scene/distance_map.h"
#include "tests/support/obj_file.h"
#include "tests/support/paths/paths.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

struct MeshFile {
  std::string name;
  double scale_m = 1;
  double reach_m = 0;  // of the points around its surface
};

TriangleMesh Read(const MeshFile& file) {
  return ReadObj(SourcePath("client/examples/meshes/" + file.name), file.scale_m);
}

const MeshFile kTable = {"table.obj", 1.0, 0.03};
const MeshFile kBody = {"body_male.obj", 0.1, 0.08};

// Distances and signs at random points around the mesh against brute force and winding numbers.
void ExpectWithinBound(const MeshFile& file, const DistanceMapSettings& settings,
                       size_t point_count) {
  const TriangleMesh mesh = Read(file);
  const auto map = DistanceMap::Build(mesh, settings).value();
  double worst = 0;
  double sum_sq = 0;
  for (const Vector3d& p : PointsAround(mesh, point_count, file.reach_m)) {
    if ((p.array() < map->low_m().array()).any() || (p.array() > map->high_m().array()).any()) {
      continue;
    }
    const double exact = BruteForceSignedDistance(mesh, p);
    const double error = std::abs(map->DistanceAt(p) - exact);
    ASSERT_LE(error, map->error_bound_m()) << p.transpose();
    // Beyond the bound the sign is never wrong.
    if (std::abs(exact) > map->error_bound_m()) {
      ASSERT_EQ(map->DistanceAt(p) < 0, exact < 0) << p.transpose();
    }
    worst = std::max(worst, error);
    sum_sq += error * error;
  }
  std::cout << file.name << ": cell " << 1e3 * map->cell_m() << " mm, error at most " << 1e3 * worst
            << " mm, RMS " << 1e3 * std::sqrt(sum_sq / static_cast<double>(point_count))
            << " mm, bound " << 1e3 * map->error_bound_m() << " mm\n";
}

void ExpectBuiltWithin(const MeshFile& file, double cpu_seconds) {
  const TriangleMesh mesh = Read(file);
  const std::clock_t start = std::clock();
  const auto map = DistanceMap::Build(mesh).value();
  const double spent = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::cout << file.name << ": " << mesh.triangles.size() << " triangles, "
            << map->samples_m().size() << " samples, " << spent << " s\n";
  EXPECT_LE(spent, cpu_seconds);
}

TEST(DistanceMapMeshesTest, ACoarseTable) {
  ExpectWithinBound(kTable, {.resolution = 20}, 100);
}

TEST(DistanceMapMeshesLong, TableAtTenThousandPoints) {
  ExpectWithinBound(kTable, {}, 10'000);
}

TEST(DistanceMapMeshesLong, BodyAtTenThousandPoints) {
  ExpectWithinBound(kBody, {}, 10'000);
}

// The limits leave room for a slower machine; the time taken is printed.
TEST(DistanceMapMeshesLong, BuildTimes) {
  ExpectBuiltWithin(kTable, 5);
  ExpectBuiltWithin(kBody, 5);
}

}  // namespace
}  // namespace drape::test
