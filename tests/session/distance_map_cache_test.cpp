#include "server/session/distance_map_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <new>
#include <thread>
#include <vector>

#include "tests/support/solids/solids.h"

namespace drape {
namespace {

// Small enough to be sampled in a moment at the default resolution: a slab of few cells' height.
TriangleMesh Slab(double length_m = 1) {
  return test::BoxMesh({0, 0, 0}, {length_m, 0.02, 0.3});
}

TEST(DistanceMapCache, EqualMeshesShareOneMap) {
  DistanceMapCache cache;
  const auto first = cache.Get(Slab(), {}, nullptr).value();
  EXPECT_EQ(cache.Get(Slab(), {}, nullptr).value(), first);
  EXPECT_NE(cache.Get(Slab(1.5), {}, nullptr).value(), first);
}

TEST(DistanceMapCache, ABuildWithoutMemoryIsOverForThoseWhoWaitForItsMap) {
  DistanceMapCache cache;
  StopWhenUnwanted without_memory([]() -> bool { throw std::bad_alloc(); });
  EXPECT_THROW((void)cache.Get(Slab(), {}, &without_memory), std::bad_alloc);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  StopWhenUnwanted in_time([&] { return std::chrono::steady_clock::now() > until; });
  EXPECT_NO_THROW((void)cache.Get(Slab(), {}, &in_time)) << "waits for a build that is over";
}

TEST(DistanceMapCaches, NoTenantCanTellThatAnotherOneHasAMesh) {
  DistanceMapCaches caches;
  const auto of_alice = caches.Of("alice"), of_bob = caches.Of("bob");
  EXPECT_EQ(caches.Of("alice"), of_alice);
  const auto map = of_alice->Get(Slab(), {}, nullptr).value();
  EXPECT_EQ(caches.Of("alice")->Get(Slab(), {}, nullptr).value(), map);
  EXPECT_EQ(of_bob->size(), 0u) << "Bob's would be built";
  EXPECT_NE(of_bob->Get(Slab(), {}, nullptr).value(), map);
}

TEST(DistanceMapCaches, TheyHoldNothingAlive) {
  DistanceMapCaches caches;
  const std::weak_ptr<DistanceMapCache> cache = caches.Of("alice");
  EXPECT_TRUE(cache.expired());
}

TEST(DistanceMapCache, ItHoldsNothingAlive) {
  DistanceMapCache cache;
  {
    const auto map = cache.Get(Slab(), {}, nullptr).value();
    EXPECT_EQ(cache.size(), 1u);
  }
  EXPECT_EQ(cache.size(), 0u);
  EXPECT_TRUE(cache.Get(Slab(), {}, nullptr).ok());
}

TEST(DistanceMapCache, ManyThreadsGetTheMapThatOneOfThemBuilds) {
  DistanceMapCache cache;
  std::vector<std::shared_ptr<const DistanceMap>> maps(4);
  std::vector<std::thread> threads;
  for (auto& map : maps) {
    threads.emplace_back([&] { map = cache.Get(Slab(), {}, nullptr).value(); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& map : maps) EXPECT_EQ(map, maps[0]);
}

TEST(DistanceMapCache, AnErrorIsEverybodysOwn) {
  DistanceMapCache cache;
  TriangleMesh open = Slab();
  open.triangles.pop_back();
  EXPECT_EQ(cache.Get(open, {}, nullptr).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(cache.Get(open, {}, nullptr).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(cache.size(), 0u);
}

TEST(DistanceMapCache, ACancelledBuildLeavesRoomForTheNext) {
  DistanceMapCache cache;
  std::atomic<int> asked = 0;
  StopWhenUnwanted interruption([&] { return ++asked > 3; });
  EXPECT_THROW((void)cache.Get(Slab(), {}, &interruption), WorkStopped);
  EXPECT_EQ(asked, 4) << "it stops at once";
  EXPECT_TRUE(cache.Get(Slab(), {}, nullptr).ok());
}

// The second one waits for a build that lasts until it is cancelled, and gives up.
TEST(DistanceMapCache, WhoWaitsMayGiveUp) {
  DistanceMapCache cache;
  std::atomic<bool> is_building = false, ends = false;
  std::thread builder([&] {
    StopWhenUnwanted at_the_end([&] {
      is_building = true;
      while (!ends) std::this_thread::yield();
      return true;
    });
    EXPECT_THROW((void)cache.Get(Slab(), {}, &at_the_end), WorkStopped);
  });
  while (!is_building) std::this_thread::yield();
  StopWhenUnwanted at_once([] { return true; });
  EXPECT_THROW((void)cache.Get(Slab(), {}, &at_once), WorkStopped);
  ends = true;
  builder.join();
}

}  // namespace
}  // namespace drape
