// The surface of several cloths, some of which touch themselves.
#include <gtest/gtest.h>

#include <set>

#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/self_contact/exact_orientation.h"
#include "server/solver/self_contact/pair_search.h"
#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::CandidatePair;
using self_contact::PairKind;
using self_contact::PairSearch;
using self_contact::PatchPair;
using self_contact::PatchSearch;
using self_contact::Vector3d;

constexpr double kRounding_m = 1e-9;

class WorldSurface : public ::testing::Test {
 protected:
  WorldSurface() {
    const std::vector<Scene> scenes = {Grid(10, 9, 1, 0.9), MeshedGrid(8, 8, 0.9, 0.9),
                                       Grid(6, 11, 0.7, 1)};
    // Crumpled into each other, so that everything is near something.
    for (uint32_t k = 0; k < 3; ++k) {
      surfaces_.emplace_back(*scenes[k].model);
      for (Vector3d p : Folded(*scenes[k].model, 2.0 + k, 0.35, 0.02, k)) {
        p += Vector3d{0, 0.01 * k, 0, 0};
        positions_.push_back(p);
      }
    }
  }
  Vector3d At(uint32_t i) const { return positions_[i]; }
  // Whether a pair is of two cloths, or of one that touches itself.
  bool MayTouch(uint32_t i, uint32_t j) const {
    const uint32_t a = world_.member_of_particle(i), b = world_.member_of_particle(j);
    return a != b || kTouchThemselves[a];
  }

  static constexpr std::array<bool, 3> kTouchThemselves = {true, false, true};
  static constexpr std::array<double, 3> kThicknesses_m = {0.02, 0.03, 0.01};
  std::vector<ContactSurface> surfaces_ = [] {
    std::vector<ContactSurface> surfaces;
    surfaces.reserve(3);  // members are pointed to
    return surfaces;
  }();
  std::vector<Vector3d> positions_;
  const ContactSurface& World() {
    std::vector<SurfaceMember> members;
    for (size_t k = 0; k < 3; ++k) members.push_back({&surfaces_[k], kTouchThemselves[k]});
    world_ = ContactSurface(members);
    return world_;
  }
  ContactSurface world_{std::span<const SurfaceMember>{}};
};

// Every pair that may touch and is near, and no other, by brute force: at half the sum of the
// thicknesses, and across two cloths whatever the rest shapes are.
TEST_F(WorldSurface, ASearchFindsWhatMayTouch) {
  const ContactSurface& world = World();
  const Thicknesses<double> thicknesses(0.03, kThicknesses_m);
  const std::vector<Vector3d> at_rest(positions_.size());
  PatchSearch<Vector3d> patch_search;
  std::vector<PatchPair> patches;
  self_contact::SearchBudget budget = Unlimited();
  ASSERT_TRUE(patch_search.Find(world, {positions_, at_rest}, thicknesses.most, budget, patches));
  PairSearch<Vector3d> pair_search;
  pair_search.Begin(world, positions_, thicknesses, budget);
  std::set<std::pair<PairKind, std::array<uint32_t, 4>>> found;
  std::vector<CandidatePair<Vector3d>> pairs;
  for (const PatchPair& two : patches) pair_search.Find(two, 0, pairs);
  for (const CandidatePair<Vector3d>& pair : pairs) {
    std::array<uint32_t, 4> i = pair.particles;
    EXPECT_TRUE(MayTouch(i[0], i[3]));
    if (pair.kind == PairKind::kEdges && std::pair(i[2], i[3]) < std::pair(i[0], i[1])) {
      i = {i[2], i[3], i[0], i[1]};
    }
    EXPECT_TRUE(found.emplace(pair.kind, i).second) << "twice";
  }
  size_t of_two = 0, of_one = 0;
  ForAllPairs(world, [&](PairKind kind, const std::array<uint32_t, 4>& i) {
    if (!MayTouch(i[0], i[3])) return;
    const uint32_t a = world.member_of_particle(i[0]), b = world.member_of_particle(i[3]);
    const double thickness_m = (kThicknesses_m[a] + kThicknesses_m[b]) / 2;
    const double touch_m = self_contact::TouchDistance_m(world, kind, i, thickness_m, a == b);
    if (a != b) {
      EXPECT_EQ(touch_m,
                kind == PairKind::kEdges ? self_contact::kEdgeShare * thickness_m : thickness_m);
    }
    const double distance_m = self_contact::Length(
        self_contact::Closest<Vector3d>(kind, {At(i[0]), At(i[1]), At(i[2]), At(i[3])}).difference);
    if (distance_m > touch_m - kRounding_m) return;
    ++(a == b ? of_one : of_two);
    EXPECT_TRUE(found.contains({kind, i})) << a << " and " << b << ", " << distance_m;
  });
  EXPECT_GT(of_two, 100u);
  EXPECT_GT(of_one, 100u);
}

// The same edges and triangles as if all were one mesh, but for those of a cloth alone that passes
// through itself.
TEST_F(WorldSurface, CrossingsAreThoseThatMayBe) {
  const ContactSurface& world = World();
  std::set<std::pair<uint32_t, uint32_t>> found;
  for (const auto& [edge, triangle] : self_contact::FindCrossings(world, positions_)) {
    EXPECT_TRUE(found.emplace(edge, triangle).second);
  }
  size_t expected = 0;
  const auto point = [&](uint32_t i) { return self_contact::FromVector(At(i)); };
  for (uint32_t e = 0; e < world.edges().size(); ++e) {
    const auto [i, j] = world.edges()[e];
    for (uint32_t t = 0; t < world.triangles().size(); ++t) {
      const auto& [a, b, c] = world.triangles()[t];
      if (!MayTouch(i, a) || i == a || i == b || i == c || j == a || j == b || j == c) continue;
      if (!self_contact::Crosses(point(i), point(j), point(a), point(b), point(c))) continue;
      ++expected;
      EXPECT_TRUE(found.contains({e, t}));
    }
  }
  EXPECT_EQ(found.size(), expected);
  EXPECT_GT(expected, 20u);
}

TEST_F(WorldSurface, AReportCountsPairsOfTwoForBoth) {
  const ContactSurface& world = World();
  const auto measures = self_contact::MeasureSelfContacts(
      world, Thicknesses<double>(0.03, kThicknesses_m), positions_);
  ASSERT_EQ(measures.size(), 3u);
  std::array<uint32_t, 3> crossings{};
  for (const auto& [edge, triangle] : self_contact::FindCrossings(world, positions_)) {
    const uint32_t a = world.member_of_particle(world.edges()[edge][0]);
    const uint32_t b = world.member_of_particle(world.triangles()[triangle][0]);
    ++crossings[a];
    if (b != a) ++crossings[b];
  }
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(measures[k].crossings, crossings[k]) << k;
    EXPECT_GT(measures[k].near_pairs, 0u) << k;
    EXPECT_LT(measures[k].smallest_distance_m, 0.04) << k;
  }
}

}  // namespace
}  // namespace drape::test
