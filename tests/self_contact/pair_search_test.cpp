#include "server/solver/self_contact/pair_search.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::CandidatePair;
using self_contact::PairKind;
using self_contact::PairSearch;
using self_contact::PatchPair;
using self_contact::Vector3d;
using self_contact::Vector3f;

template <class V>
class PairSearchTest : public ::testing::Test {};
using SearchPrecisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(PairSearchTest, SearchPrecisions);

// Of each two patches exactly what is near, and no gap that is larger than what there is.
TYPED_TEST(PairSearchTest, FindsWhatIsNear) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  using PairName = std::pair<PairKind, std::array<uint32_t, 4>>;
  constexpr double kThickness = 0.02, kReach = 0.01, kFar = 0.04, kRounding = 1e-5;
  size_t near = 0;
  for (const Scene& scene : {Grid(16, 12, 1, 0.75), MeshedGrid(14, 14, 1, 1)}) {
    const ContactSurface surface(*scene.model);
    const PatchOwners owners(surface);
    for (const double folds : {0.0, 1.0, 6.0}) {
      for (const double noise : {0.0, 0.003, 0.03}) {
        const auto exact = Folded(*scene.model, folds, folds > 0 ? 0.35 : 1.0, noise, 4);
        const std::vector<V> rounded = As<V>(exact);
        PairSearch<V> search;
        self_contact::SearchBudget budget = Unlimited();
        search.Begin(surface, rounded, Real(kThickness), budget);
        std::map<PairName, Real> found;
        std::map<PatchPair, Real> gaps, others;
        for (uint32_t p = 0; p < surface.patches().size(); ++p) {
          for (uint32_t q = p; q < surface.patches().size(); ++q) {
            gaps[{p, q}] = search.Gap({p, q});
            std::vector<CandidatePair<V>> pairs;
            others[{p, q}] = search.Find({p, q}, Real(kReach), pairs, Real(p % 2 == 0 ? kFar : 0));
            EXPECT_GE(others.at({p, q}), Real(kReach));
            for (const CandidatePair<V>& pair : pairs) {
              EXPECT_LE(pair.distance, pair.touch + Real(kReach));
              // The order of edges is that of the surface or the other one.
              std::array<uint32_t, 4> i = pair.particles;
              if (pair.kind == PairKind::kEdges && std::pair(i[2], i[3]) < std::pair(i[0], i[1])) {
                i = {i[2], i[3], i[0], i[1]};
              }
              EXPECT_TRUE(found.try_emplace({pair.kind, i}, pair.distance).second) << "twice";
            }
          }
        }
        ForAllPairs(surface, [&](PairKind kind, const std::array<uint32_t, 4>& particles) {
          const std::array<Vector3d, 4> p = {exact[particles[0]], exact[particles[1]],
                                             exact[particles[2]], exact[particles[3]]};
          const double distance = self_contact::Length(self_contact::Closest(kind, p).difference);
          ASSERT_LE(double{gaps.at(owners.Of(kind, particles))}, distance + kRounding);
          const double touch =
              self_contact::TouchDistance_m(surface, kind, particles, kThickness, true);
          const auto pair = found.find({kind, particles});
          if (pair == found.end()) {
            ASSERT_LE(double{others.at(owners.Of(kind, particles))}, distance - touch + kRounding);
          }
          if (distance > touch + kReach - kRounding) return;
          ++near;
          ASSERT_NE(pair, found.end()) << "folds " << folds << ", noise " << noise;
          EXPECT_NEAR(double{pair->second}, distance, kRounding);
        });
      }
    }
  }
  EXPECT_GT(near, 10000u);
}

// Flat cloth in which single particles have been pulled across their neighbours: what lies on both
// sides of such a fold is near, however flat each patch is.
TYPED_TEST(PairSearchTest, NoGapIsLargerThanAcrossSmallFolds) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  constexpr double kCell = 0.1, kRounding = 1e-6;
  size_t flat = 0, near = 0;
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    const Scene scene = seed % 2 == 0 ? Grid(11, 11, 1, 1) : MeshedGrid(11, 11, 1, 1);
    const ContactSurface surface(*scene.model);
    const PatchOwners owners(surface);
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    std::vector<Vector3d> exact;
    for (const Eigen::Vector3d& p : scene.model->rest_positions_m()) {
      exact.push_back(Vector3d{p.x(), p.y() + between(0, 0.002), p.z(), 0});
    }
    for (int pulled = 0; pulled < 4; ++pulled) {
      exact[random() % exact.size()] +=
          Vector3d{between(-2.5, 2.5) * kCell, 0, between(-2.5, 2.5) * kCell, 0};
    }
    const std::vector<V> rounded = As<V>(exact);
    PairSearch<V> search;
    self_contact::SearchBudget budget = Unlimited();
    search.Begin(surface, rounded, Real(0.01), budget);
    std::map<PatchPair, Real> gaps;
    for (const ContactNeighbours& pair : surface.neighbours()) {
      gaps[{pair.first, pair.second}] = search.Gap({pair.first, pair.second});
      flat += gaps[{pair.first, pair.second}] > 0;
    }
    ForAllPairs(surface, [&](PairKind kind, const std::array<uint32_t, 4>& particles) {
      const auto gap = gaps.find(owners.Of(kind, particles));
      if (gap == gaps.end()) return;
      const std::array<Vector3d, 4> p = {exact[particles[0]], exact[particles[1]],
                                         exact[particles[2]], exact[particles[3]]};
      const double distance = self_contact::Length(self_contact::Closest(kind, p).difference);
      near += distance < 0.01;
      ASSERT_LE(double{gap->second}, distance + kRounding) << "seed " << seed;
    });
  }
  EXPECT_GT(flat, 1000u);
  EXPECT_GT(near, 1000u);
}

// Cells smaller than the thickness: neighbours keep half of their distance.
TEST(PairSearch, TouchesFinerCellsLater) {
  const Scene scene = Grid(5, 5, 0.04, 0.04);
  const ContactSurface surface(*scene.model);
  const double cell = 0.01;
  const std::array<uint32_t, 4> next = {0, 1, 5, 6};  // parallel edges of neighbouring rows
  EXPECT_NEAR(self_contact::TouchDistance_m(surface, PairKind::kEdges, next, 0.02, true), cell / 2,
              1e-12);
  EXPECT_NEAR(self_contact::TouchDistance_m(surface, PairKind::kEdges, next, 0.005, true),
              self_contact::kEdgeShare * 0.005, 1e-12);
  const std::array<uint32_t, 4> far = {0, 22, 23, 24};
  EXPECT_NEAR(self_contact::TouchDistance_m(surface, PairKind::kVertexTriangle, far, 0.02, true),
              0.02, 1e-12);
}

}  // namespace
}  // namespace drape::test
