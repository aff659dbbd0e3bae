#include "server/solver/self_contact/crossing_search.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/solver/self_contact/exact_orientation.h"
#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::FindCrossings;
using self_contact::FlagCrossings;
using self_contact::FromVector;
using self_contact::MeasureSelfContacts;
using self_contact::SearchBudget;
using self_contact::Vector3d;

TEST(CrossingSearch, FindsAllAndOnlyThose) {
  size_t total = 0;
  for (const Scene& scene : {Grid(15, 11, 1, 0.7), MeshedGrid(12, 12, 1, 1)}) {
    const ContactSurface surface(*scene.model);
    for (const double folds : {0.0, 2.0, 5.0}) {
      for (const double noise : {0.0, 0.02, 0.1}) {
        const auto positions = Folded(*scene.model, folds, folds > 0 ? 0.3 : 1.0, noise, 7);
        size_t expected = 0;
        for (const auto& [i, j] : surface.edges()) {
          for (const auto& [a, b, c] : surface.triangles()) {
            if (i == a || i == b || i == c || j == a || j == b || j == c) continue;
            expected += self_contact::Crosses(FromVector(positions[i]), FromVector(positions[j]),
                                              FromVector(positions[a]), FromVector(positions[b]),
                                              FromVector(positions[c]));
          }
        }
        const auto found = FindCrossings(surface, positions);
        EXPECT_EQ(found.size(), expected) << folds << " folds, noise " << noise;
        if (folds == 0 && noise == 0) {
          EXPECT_EQ(expected, 0u);
        }
        total += expected;
      }
    }
  }
  EXPECT_GT(total, 1000u);
}

TEST(CrossingSearch, FlagsTheParticlesOfWhatCrosses) {
  const Scene scene = Grid(25, 11, 2, 0.9);
  const ContactSurface surface(*scene.model);
  auto positions = Folded(*scene.model, 0, 1, 0, 7);
  for (Vector3d& p : positions) {
    if (p[0] < 0.5) p = Vector3d{0.9 - p[0], 0.1 - 0.4 * p[0], 0.7 * p[2], 0};
  }
  std::vector<bool> expected(positions.size(), false);
  for (const auto& [edge, triangle] : FindCrossings(surface, positions)) {
    for (const uint32_t i : surface.edges()[edge]) expected[i] = true;
    for (const uint32_t i : surface.triangles()[triangle]) expected[i] = true;
  }
  const auto crossing = std::count(expected.begin(), expected.end(), true);
  ASSERT_GT(crossing, 10);
  ASSERT_LT(crossing, std::ssize(expected) - 10);
  EXPECT_EQ(FlagCrossings(surface, positions), expected);
  EXPECT_TRUE(FlagCrossings(surface, Folded(*scene.model, 0, 1, 0, 7)).empty());
}

// Where a search is given up nothing is known of any particle.
TEST(CrossingSearch, FlagsAllWhereItIsGivenUp) {
  const Scene scene = Grid(15, 11, 1, 0.7);
  const ContactSurface surface(*scene.model);
  const auto flat = Folded(*scene.model, 0, 1, 0, 7);
  const std::vector<bool> all(flat.size(), true);
  EXPECT_EQ(FlagCrossings(surface, flat, SearchBudget(200)), all);
  EXPECT_TRUE(FlagCrossings(surface, flat, SearchBudget(1 << 20)).empty());
}

// Two halves of a sheet, one flat above the other.
TEST(CrossingSearch, MeasuresTheSmallestDistanceOfNearPairs) {
  const Scene scene = Grid(11, 5, 1, 0.4);
  const ContactSurface surface(*scene.model);
  std::vector<Vector3d> positions;
  for (const Eigen::Vector3d& p : scene.model->rest_positions_m()) {
    const bool is_above = p.x() > 0.5;
    positions.push_back(Vector3d{is_above ? 1 - p.x() : p.x(), is_above ? 0.004 : 0.0, p.z(), 0});
  }
  const auto near = MeasureSelfContacts(surface, 0.004, positions)[0];
  EXPECT_EQ(near.crossings, 0u);
  EXPECT_GT(near.near_pairs, 30u);
  // Only where the halves are joined they come nearer: edges from one to the other cross above the
  // middle of each other.
  EXPECT_NEAR(near.smallest_distance_m, 0.002, 1e-5);
  EXPECT_LT(MeasureSelfContacts(surface, 0.002, positions)[0].near_pairs, 6u);
  const auto flat = MeasureSelfContacts(surface, 0.004, Folded(*scene.model, 0, 1, 0, 1))[0];
  EXPECT_EQ(flat.near_pairs, 0u);
  EXPECT_EQ(flat.smallest_distance_m, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace drape::test
