#include "server/solver/self_contact/contact_lists.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::ContactLists;
using self_contact::ContactPair;
using self_contact::kCoreShare;
using self_contact::PairKind;
using self_contact::PatchPair;
using self_contact::ScalarOf;
using self_contact::Vector3d;
using self_contact::Vector3f;

template <class V>
class ContactListsTest : public ::testing::Test {};
using ListPrecisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(ContactListsTest, ListPrecisions);

std::vector<PatchPair> AllPatchPairs(const ContactSurface& surface) {
  std::vector<PatchPair> pairs;
  for (uint32_t p = 0; p < surface.patches().size(); ++p) {
    for (uint32_t q = p; q < surface.patches().size(); ++q) pairs.push_back({p, q});
  }
  return pairs;
}

// The lists of a folded sheet that moves as a whole and shakes.
template <class V>
struct Play {
  using Real = ScalarOf<V>;
  using Window = typename ContactLists<V>::Window;
  using PairName = std::pair<PairKind, std::array<uint32_t, 4>>;
  static constexpr double kThickness = 0.02;

  explicit Play(const Scene& scene)
      : surface(*scene.model), starts(As<V>(Folded(*scene.model, 3, 0.35, 0.003, 4))) {
    inverse_masses.assign(starts.size(), 1);
    lists.Begin(surface, Real(kThickness), Real(0.06), is_crossing, 1u << 24, budget);
    lists.Replace(AllPatchPairs(surface));
  }

  void Move(double shake_m, std::mt19937& random) {
    std::uniform_real_distribution<double> shake(-shake_m, shake_m);
    ends = starts;
    for (V& p : ends) {
      p += V{Real(0.01), Real(shake(random)), Real(shake(random)), 0};
      p[1] += Real(0.1 * shake_m) * p[2];
    }
  }
  // Particles go `share` of the way.
  void MeasureWays(double share) {
    lists.MeasureWays([&](uint32_t i) { return V(Real(share) * (ends[i] - starts[i])); });
  }
  void Wake(const Window& window) {
    ASSERT_TRUE(lists.FindDue(starts, window));
    for (const auto& due : lists.due()) {
      ContactPair<V>& pair = lists.pairs()[due.pair];
      EXPECT_FALSE(pair.is_active);
      FindNormal<V>(starts.data(), inverse_masses, pair);
      if (!lists.IsNear(due, window)) continue;
      pair.is_active = true;
      active.push_back(due.pair);
      std::array<uint32_t, 4> i = pair.particles;
      if (pair.kind == PairKind::kEdges && std::pair(i[2], i[3]) < std::pair(i[0], i[1])) {
        i = {i[2], i[3], i[0], i[1]};
      }
      EXPECT_TRUE(names.insert({pair.kind, i}).second) << "active twice";
    }
  }
  // Of pairs that are nearer than this share of where they touch, after a share of the way: how
  // many, and all are active.
  size_t ExpectActive(double touch_share, double way_share) {
    size_t near = 0;
    ForAllPairs(surface, [&](PairKind kind, const std::array<uint32_t, 4>& particles) {
      std::array<V, 4> p;
      for (int k = 0; k < 4; ++k) {
        const uint32_t i = particles[k];
        p[k] = starts[i] + Real(way_share) * (ends[i] - starts[i]);
      }
      const double distance = self_contact::Length(self_contact::Closest(kind, p).difference);
      const double touch =
          self_contact::TouchDistance_m(surface, kind, particles, kThickness, true);
      if (distance > touch_share * touch - 1e-5) return;
      ++near;
      EXPECT_TRUE(names.count({kind, particles})) << distance << " of " << touch;
    });
    return near;
  }
  void End() {
    lists.Advance();
    for (const uint32_t k : active) lists.pairs()[k].is_active = false;
    active.clear();
    names.clear();
    starts = ends;
  }

  ContactSurface surface;
  std::vector<V> starts, ends;
  std::vector<Real> inverse_masses;
  std::vector<bool> is_crossing;
  self_contact::SearchBudget budget = Unlimited();
  ContactLists<V> lists;
  std::vector<uint32_t> active;
  std::set<PairName> names;
};

// Slow and fast motion in turn; of each substep half the way is known at first.
TYPED_TEST(ContactListsTest, WhatComesNearIsActive) {
  using V = TypeParam;
  std::mt19937 random(7);
  size_t touching = 0, in_core = 0;
  for (const Scene& scene : {Grid(12, 10, 1, 0.75), MeshedGrid(10, 10, 1, 1)}) {
    Play<V> play(scene);
    for (int substep = 0; substep < 24; ++substep) {
      SCOPED_TRACE(substep);
      play.Move(std::array{1e-5, 1e-3, 0.01}[substep / 4 % 3], random);
      play.MeasureWays(0.5);
      play.Wake({});
      touching += play.ExpectActive(1, 0.5);
      play.MeasureWays(1);
      play.Wake({.guards = true});
      in_core += play.ExpectActive(kCoreShare, 1);
      if (this->HasFailure()) return;
      // A list that is made anew where it was goes on.
      if (substep % 5 == 0) play.lists.Replace(AllPatchPairs(play.surface));
      play.End();
    }
  }
  EXPECT_GT(touching, 1000u);
  EXPECT_GT(in_core, 100u);
}

// In a substep much is active because much motion is expected, in the next one none is expected.
// The guard, which then sees how far things have gone, misses nothing that was active before.
TYPED_TEST(ContactListsTest, TheGuardFindsWhatWasActiveInAnEarlierSubstep) {
  using V = TypeParam;
  using Real = ScalarOf<V>;
  constexpr double kThin = 0.004, kExpected = 0.005, kWay = 0.0045;
  size_t in_core = 0, sleeping = 0;
  for (const Scene& scene : {Grid(12, 10, 1, 0.75), MeshedGrid(10, 10, 1, 1)}) {
    const ContactSurface surface(*scene.model);
    const PatchOwners owners(surface);
    const std::vector<V> starts = As<V>(Folded(*scene.model, 3, 0.35, 0.003, 4));
    const std::vector<Real> inverse_masses(starts.size(), 1);
    const std::vector<bool> is_crossing;
    std::map<PatchPair, std::vector<double>> distances;  // less those at which the guard acts
    ForAllPairs(surface, [&](PairKind kind, const std::array<uint32_t, 4>& i) {
      const double distance = double{self_contact::Length(
          self_contact::Closest<V>(kind, {starts[i[0]], starts[i[1]], starts[i[2]], starts[i[3]]})
              .difference)};
      const double touch = self_contact::TouchDistance_m(surface, kind, i, kThin, true);
      distances[owners.Of(kind, i)].push_back(distance - kCoreShare * touch);
    });
    for (const PatchPair& patches : AllPatchPairs(surface)) {
      if (patches.first == patches.second) continue;
      self_contact::SearchBudget budget = Unlimited();
      ContactLists<V> lists;
      lists.Begin(surface, Real(kThin), Real(0.06), is_crossing, 1u << 24, budget);
      lists.Replace(std::array{patches});
      std::vector<bool> moves(starts.size(), false);
      for (const uint32_t i : surface.corners_of(surface.patches()[patches.second])) {
        moves[i] = true;
      }
      for (const uint32_t i : surface.corners_of(surface.patches()[patches.first])) {
        moves[i] = false;
      }
      const auto measure = [&](double way) {
        lists.MeasureWays([&](uint32_t i) { return V{moves[i] ? Real(way) : Real(0), 0, 0, 0}; });
      };
      std::vector<uint32_t> active;
      const auto wake = [&](bool guards) {
        ASSERT_TRUE(lists.FindDue(starts, {.guards = guards}));
        for (const auto& due : lists.due()) {
          ContactPair<V>& pair = lists.pairs()[due.pair];
          FindNormal<V>(starts.data(), inverse_masses, pair);
          if (!lists.IsNear(due, {.guards = guards})) continue;
          pair.is_active = true;
          active.push_back(due.pair);
        }
      };
      measure(kExpected);
      wake(false);
      measure(0);
      wake(true);
      lists.Advance();
      for (const uint32_t k : active) lists.pairs()[k].is_active = false;
      active.clear();
      wake(false);
      sleeping += active.empty();
      measure(kWay);
      wake(true);
      const std::vector<double>& near = distances[patches];
      const auto expected =
          std::count_if(near.begin(), near.end(), [&](double d) { return d < kWay - 1e-5; });
      in_core += static_cast<size_t>(expected);
      ASSERT_GE(std::ssize(active), expected) << patches.first << ", " << patches.second;
    }
  }
  EXPECT_GT(in_core, 50u);
  EXPECT_GT(sleeping, 100u);
}

TYPED_TEST(ContactListsTest, WhatIsFarSleeps) {
  using V = TypeParam;
  std::mt19937 random(7);
  Play<V> play(Grid(12, 10, 1, 0.75));
  play.Move(0, random);
  play.MeasureWays(1);
  play.Wake({});
  play.End();
  // All particles have moved alike: nothing is due but what touches.
  play.Move(0, random);
  play.MeasureWays(1);
  ASSERT_TRUE(play.lists.FindDue(play.starts, {}));
  for (const auto& due : play.lists.due()) {
    const ContactPair<V>& pair = play.lists.pairs()[due.pair];
    EXPECT_LT(pair.gap, pair.touch + 1e-5);
  }
}

TYPED_TEST(ContactListsTest, StopAtTheLimit) {
  using V = TypeParam;
  using Real = ScalarOf<V>;
  const Scene scene = Grid(16, 16, 1, 1);
  const ContactSurface surface(*scene.model);
  const auto crumpled = As<V>(Folded(*scene.model, 6, 0.2, 0.02, 5));
  for (const size_t most : {size_t{100}, size_t{1} << 24}) {
    ContactLists<V> lists;
    const std::vector<bool> is_crossing;
    self_contact::SearchBudget budget = Unlimited();
    lists.Begin(surface, Real(0.1), Real(0.06), is_crossing, most, budget);
    lists.Replace(AllPatchPairs(surface));
    EXPECT_EQ(lists.FindDue(crumpled, {}), most > 100);
    EXPECT_GT(lists.pairs().size(), 100u);
  }
}

// There are too many pairs, then fewer: what was due in lists that had been opened is due again.
TYPED_TEST(ContactListsTest, NothingIsLostWhereThereWasNoRoom) {
  using V = TypeParam;
  using Real = ScalarOf<V>;
  const Scene scene = Grid(16, 12, 1, 0.75);
  const ContactSurface surface(*scene.model);
  const std::vector<V> starts = As<V>(Folded(*scene.model, 3, 0.35, 0.003, 4));
  const std::vector<PatchPair> all = AllPatchPairs(surface);
  const std::span<const PatchPair> some = std::span(all).first(all.size() / 2);
  const std::vector<bool> is_crossing;
  self_contact::SearchBudget budget = Unlimited();
  const auto begin = [&](ContactLists<V>& lists, size_t most_pairs) {
    lists.Begin(surface, Real(0.02), Real(0.06), is_crossing, most_pairs, budget);
  };
  const auto find = [&](ContactLists<V>& lists) {
    lists.MeasureWays([](uint32_t i) { return V{Real(i % 2 == 0 ? 0.01 : -0.01), 0, 0, 0}; });
    return lists.FindDue(starts, {.guards = true});
  };
  ContactLists<V> expected;
  begin(expected, 1u << 24);
  expected.Replace(some);
  ASSERT_TRUE(find(expected));
  const size_t pairs = expected.pairs().size(), due = expected.due().size();
  ASSERT_GT(due, 100u);

  ContactLists<V> lists;
  begin(lists, pairs);
  lists.Replace(all);
  EXPECT_FALSE(find(lists));
  lists.Replace(some);
  ASSERT_TRUE(find(lists));
  EXPECT_EQ(lists.due().size(), due);

  // The same where there was too much to look at, and in the next substep there is not.
  ContactLists<V> others;
  begin(others, 1u << 24);
  others.Replace(some);
  budget = self_contact::SearchBudget(1000);
  EXPECT_FALSE(find(others));
  EXPECT_TRUE(budget.is_spent());
  budget = Unlimited();
  ASSERT_TRUE(find(others));
  EXPECT_EQ(others.due().size(), due);
}

}  // namespace
}  // namespace drape::test
