#include "server/solver/self_contact/pair_search.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::CandidatePair;
using self_contact::PairKind;
using self_contact::PairSearch;
using self_contact::SearchState;
using self_contact::Vector3d;
using self_contact::Vector3f;

using PairName = std::pair<PairKind, std::array<uint32_t, 4>>;

std::vector<Scene> SearchedSheets() {
  return {Grid(16, 12, 1, 0.75), MeshedGrid(14, 14, 1, 1)};
}

template <class V>
std::map<PairName, CandidatePair<V>> Find(const ContactSurface& surface,
                                          const std::vector<V>& positions,
                                          const std::vector<V>& velocities, double duration,
                                          double drift, double thickness) {
  using Real = self_contact::ScalarOf<V>;
  PairSearch<V> search;
  std::vector<CandidatePair<V>> pairs;
  EXPECT_TRUE(search.Find(
      surface, {positions, velocities, static_cast<Real>(duration), static_cast<Real>(drift)},
      static_cast<Real>(thickness), 1u << 24, pairs));
  std::map<PairName, CandidatePair<V>> found;
  for (const auto& pair : pairs) {
    // The order of edges, and of the ends of an edge, is that of the surface or the other one.
    std::array<uint32_t, 4> p = pair.particles;
    if (pair.kind == PairKind::kEdges && std::pair(p[2], p[3]) < std::pair(p[0], p[1])) {
      p = {p[2], p[3], p[0], p[1]};
    }
    EXPECT_TRUE(found.try_emplace({pair.kind, p}, pair).second) << "found twice";
  }
  return found;
}

template <class V>
class PairSearchTest : public ::testing::Test {};
using SearchPrecisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(PairSearchTest, SearchPrecisions);

// In folds, flat, moving as a whole and apart: what comes near at some time is found, and not
// earlier than it says.
TYPED_TEST(PairSearchTest, MissesNoPairThatTouchesOnTheWay) {
  using V = TypeParam;
  constexpr double kThickness = 0.02, kDuration = 0.02;
  std::mt19937 random(3);
  size_t touching = 0;
  for (const Scene& scene : SearchedSheets()) {
    const ContactSurface surface(*scene.model);
    for (const double folds : {0.0, 1.0, 3.0, 6.0}) {
      for (const double noise : {0.0, 0.003, 0.03}) {
        const auto exact = Folded(*scene.model, folds, folds > 0 ? 0.35 : 1.0, noise, 4);
        std::uniform_real_distribution<double> speed(-2 * noise / kDuration, 2 * noise / kDuration);
        std::vector<Vector3d> velocities;
        for (const Vector3d& p : exact) {
          velocities.push_back(Vector3d{10 - 5 * p[2] + speed(random), 5 * p[0], speed(random), 0});
        }
        const auto found =
            Find<V>(surface, As<V>(exact), As<V>(velocities), kDuration, 1e-4, kThickness);
        for (const double share : {0.0, 0.3, 1.0}) {
          std::vector<Vector3d> later = exact;
          for (size_t i = 0; i < later.size(); ++i) later[i] += share * kDuration * velocities[i];
          ForAllPairs(surface, [&](PairKind kind, const std::array<uint32_t, 4>& particles) {
            const std::array<Vector3d, 4> p = {later[particles[0]], later[particles[1]],
                                               later[particles[2]], later[particles[3]]};
            const double distance = self_contact::Length(self_contact::Closest(kind, p).difference);
            const double touch =
                self_contact::TouchDistance_m(surface, kind, particles, kThickness, true);
            if (distance > touch - 1e-5) return;
            ++touching;
            const auto pair = found.find({kind, particles});
            ASSERT_NE(pair, found.end()) << "folds " << folds << ", noise " << noise << ", share "
                                         << share << ", distance " << distance;
            EXPECT_LE(double{pair->second.first_touch}, share * kDuration + 1e-6);
          });
        }
      }
    }
  }
  EXPECT_GT(touching, 10000u);
}

TYPED_TEST(PairSearchTest, AFlatSheetHasNone) {
  using V = TypeParam;
  for (const Scene& scene : SearchedSheets()) {
    const ContactSurface surface(*scene.model);
    const auto flat = Folded(*scene.model, 0, 1, 0, 1);
    // All particles move alike, fast.
    const std::vector<Vector3d> velocities(flat.size(), Vector3d{20, -30, 10, 0});
    EXPECT_TRUE(Find<V>(surface, As<V>(flat), As<V>(velocities), 1.0 / 60, 0.002, 0.003).empty());
  }
}

TEST(PairSearch, StopsAtTheLimit) {
  const Scene scene = Grid(16, 16, 1, 1);
  const ContactSurface surface(*scene.model);
  const auto crumpled = Folded(*scene.model, 6, 0.2, 0.02, 5);
  const std::vector<Vector3d> at_rest(crumpled.size());
  PairSearch<Vector3d> search;
  std::vector<CandidatePair<Vector3d>> pairs;
  EXPECT_FALSE(search.Find(surface, {crumpled, at_rest}, 0.1, 100, pairs));
  EXPECT_TRUE(search.Find(surface, {crumpled, at_rest}, 0.1, 1u << 24, pairs));
  EXPECT_GT(pairs.size(), 100u);
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
