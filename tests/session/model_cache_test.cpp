#include "server/session/model_cache.h"

#include <gtest/gtest.h>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

constexpr uint64_t kPlenty_bytes = 1 << 30;

TEST(ModelCache, EqualModelsBecomeOne) {
  ModelCache cache(kPlenty_bytes);
  const auto first = cache.Share("a", ChainModel(5, {0}))->model;
  const auto second = ChainModel(5, {0});
  EXPECT_NE(first, second);
  EXPECT_EQ(cache.Share("a", second)->model, first);
  EXPECT_NE(cache.Share("a", ChainModel(5, {1}))->model, first);
}

TEST(ModelCache, ItHoldsNothingAlive) {
  ModelCache cache(kPlenty_bytes);
  std::weak_ptr<const SceneModel> watched;
  {
    const auto model = cache.Share("a", ChainModel(5))->model;
    watched = model;
    EXPECT_EQ(cache.size(), 1u);
  }
  EXPECT_TRUE(watched.expired());
  EXPECT_EQ(cache.size(), 0u);
  EXPECT_NE(cache.Share("a", ChainModel(5))->model, nullptr);
}

TEST(ModelCache, ManyModelsComeAndGo) {
  ModelCache cache(kPlenty_bytes);
  std::vector<std::shared_ptr<const SceneModel>> kept;
  for (uint32_t particles = 2; particles < 302; ++particles) {
    auto model = cache.Share("a", ChainModel(particles))->model;
    if (particles % 10 == 0) kept.push_back(std::move(model));
  }
  EXPECT_EQ(cache.size(), kept.size());
  for (const auto& model : kept) {
    EXPECT_EQ(cache.Share("a", ChainModel(model->particle_count()))->model, model);
  }
}

// A chain without constraints of its own but two neighbours each.
uint64_t CostOf(uint32_t particles) {
  return 2 * SizeOf_bytes(*ChainModel(particles));
}

TEST(ModelCache, WhatAnOwnerHasIsBounded) {
  const uint64_t one_bytes = CostOf(1000);
  ModelCache cache(4 * one_bytes);
  const auto first = cache.Share("greedy", ChainModel(1000));
  const auto again = cache.Share("greedy", ChainModel(1000));
  ASSERT_TRUE(first.ok() && again.ok());
  EXPECT_EQ(first->charge, again->charge) << "counted once";
  auto second = cache.Share("greedy", ChainModel(999));
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(cache.Share("greedy", ChainModel(998)).status().reason(), "QUOTA_EXCEEDED");
  const auto other = cache.Share("modest", ChainModel(1000));
  ASSERT_TRUE(other.ok());
  EXPECT_EQ(other->model, first->model) << "shared between owners";
  EXPECT_NE(other->charge, first->charge) << "and counted for each";
  EXPECT_EQ(cache.Share("modest", ChainModel(998)).status().reason(), "QUOTA_EXCEEDED")
      << "the rest is for others";
  const auto third = cache.Share("third", ChainModel(998));
  EXPECT_TRUE(third.ok());
  EXPECT_EQ(cache.Share("fourth", ChainModel(997)).status().reason(), "QUOTA_EXCEEDED") << "in all";
  second = SharedModel{};
  EXPECT_TRUE(cache.Share("fourth", ChainModel(996)).ok());
}

TEST(ModelCache, TheSizeOfAModelIsThatOfItsParts) {
  const uint64_t small = SizeOf_bytes(*ChainModel(1000)), large = SizeOf_bytes(*ChainModel(2000));
  // Three positions, two masses, a constraint with its indices, a tether, a place in a strip.
  EXPECT_GT(large - small, 1000u * (3 * 8 + 2 * 8 + sizeof(DistanceConstraint)));
  EXPECT_LT(large - small, 1000u * 400);
}

}  // namespace
}  // namespace drape
