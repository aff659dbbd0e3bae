#include "server/solver/self_contact/patch_search.h"

#include <gtest/gtest.h>

#include <random>

#include "server/solver/self_contact/pair_search.h"
#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::PairKind;
using self_contact::PatchPair;
using self_contact::PatchSearch;
using self_contact::SearchState;
using self_contact::Vector3d;
using self_contact::Vector3f;

template <class V>
class PatchSearchTest : public ::testing::Test {};
using PatchPrecisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(PatchSearchTest, PatchPrecisions);

// In folds, flat, moving as a whole and apart: the patches of what comes near at some time.
TYPED_TEST(PatchSearchTest, MissesNoPairThatTouchesOnTheWay) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  constexpr double kThickness = 0.02, kDuration = 0.02;
  std::mt19937 random(3);
  size_t touching = 0;
  for (const Scene& scene : {Grid(16, 12, 1, 0.75), MeshedGrid(14, 14, 1, 1)}) {
    const ContactSurface surface(*scene.model);
    const PatchOwners owners(surface);
    for (const double folds : {0.0, 1.0, 3.0, 6.0}) {
      for (const double noise : {0.0, 0.003, 0.03}) {
        const auto exact = Folded(*scene.model, folds, folds > 0 ? 0.35 : 1.0, noise, 4);
        std::uniform_real_distribution<double> speed(-2 * noise / kDuration, 2 * noise / kDuration);
        std::vector<Vector3d> velocities;
        for (const Vector3d& p : exact) {
          velocities.push_back(Vector3d{10 - 5 * p[2] + speed(random), 5 * p[0], speed(random), 0});
        }
        const std::vector<V> rounded = As<V>(exact), rounded_velocities = As<V>(velocities);
        PatchSearch<V> search;
        std::vector<PatchPair> found;
        self_contact::SearchBudget budget = Unlimited();
        search.Find(surface, {rounded, rounded_velocities, Real(kDuration), Real(1e-4)},
                    Real(kThickness), budget, found);
        EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
        EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end()) << "found twice";
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
            const PatchPair patches = owners.Of(kind, particles);
            ASSERT_TRUE(std::binary_search(found.begin(), found.end(), patches))
                << "folds " << folds << ", noise " << noise << ", share " << share << ", distance "
                << distance;
          });
        }
      }
    }
  }
  EXPECT_GT(touching, 10000u);
}

// All particles move alike, fast.
TYPED_TEST(PatchSearchTest, OfAFlatSheetFewNeighboursAreNear) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  for (const Scene& scene : {Grid(16, 12, 1, 0.75), MeshedGrid(14, 14, 1, 1)}) {
    const ContactSurface surface(*scene.model);
    const auto flat = As<V>(Folded(*scene.model, 0, 1, 0, 1));
    const std::vector<V> velocities(flat.size(), V{20, -30, 10, 0});
    PatchSearch<V> search;
    std::vector<PatchPair> found;
    self_contact::SearchBudget budget = Unlimited();
    search.Find(surface, {flat, velocities, Real(1.0 / 60), Real(0.002)}, Real(0.003), budget,
                found);
    const auto are_neighbours = [&](const PatchPair& pair) {
      return surface.AreNeighbours(pair.first, pair.second);
    };
    EXPECT_LT(std::count_if(found.begin(), found.end(), are_neighbours),
              std::ssize(surface.neighbours()) / 10);
    self_contact::PairSearch<V> pair_search;
    std::vector<self_contact::CandidatePair<V>> pairs;
    pair_search.Begin(surface, flat, Real(0.003), budget);
    for (const PatchPair& pair : found) pair_search.Find(pair, Real(0.002), pairs);
    EXPECT_TRUE(pairs.empty());
  }
}

// Whoever writes all particles to one place must not fill the memory with their pairs.
TYPED_TEST(PatchSearchTest, WhereAllIsInOnePlaceItEndsEarly) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  const Scene scene = Grid(80, 80, 1, 1);
  const ContactSurface surface(*scene.model);
  const std::vector<V> nowhere(scene.model->particle_count(), V{});
  const size_t most = self_contact::MostPatchPairs(surface);
  const size_t patches = surface.patches().size();
  ASSERT_GT(patches * (patches - 1) / 2, 2 * most);
  PatchSearch<V> search;
  std::vector<PatchPair> found;
  self_contact::SearchBudget budget = Unlimited();
  const SearchState<V> in_one_place{nowhere, nowhere, Real(1.0 / 60), Real(0.002)};
  EXPECT_FALSE(search.Find(surface, in_one_place, Real(0.003), budget, found));
  EXPECT_EQ(found.size(), most + 1);
  const auto flat = As<V>(Folded(*scene.model, 0, 1, 0, 1));
  const SearchState<V> spread_out{flat, nowhere, Real(1.0 / 60), Real(0.002)};
  EXPECT_TRUE(search.Find(surface, spread_out, Real(0.003), budget, found));
}

// The same search, with a look less than it takes.
TYPED_TEST(PatchSearchTest, EndsWhenItsBudgetIsSpent) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  const Scene scene = Grid(30, 30, 1, 1);
  const ContactSurface surface(*scene.model);
  const auto positions = As<V>(Folded(*scene.model, 6, 0.3, 0.01, 5));
  const std::vector<V> at_rest(positions.size(), V{});
  const SearchState<V> state{positions, at_rest, Real(1.0 / 60), Real(0.002)};
  PatchSearch<V> search;
  std::vector<PatchPair> all, some;
  size_t enough = 1;
  for (;; enough *= 2) {
    self_contact::SearchBudget budget(enough);
    if (search.Find(surface, state, Real(0.003), budget, all)) break;
    EXPECT_TRUE(budget.is_spent());
  }
  EXPECT_GT(enough, 8 * all.size());
  self_contact::SearchBudget too_little(enough / 4);
  EXPECT_FALSE(search.Find(surface, state, Real(0.003), too_little, some));
  EXPECT_LT(some.size(), all.size());
  std::sort(some.begin(), some.end());
  EXPECT_TRUE(std::includes(all.begin(), all.end(), some.begin(), some.end()));
}

}  // namespace
}  // namespace drape::test
