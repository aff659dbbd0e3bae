#include "server/session/model_cache.h"

#include <gtest/gtest.h>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

TEST(ModelCache, EqualModelsBecomeOne) {
  ModelCache cache;
  const auto first = cache.Share(ChainModel(5, {0}));
  const auto second = ChainModel(5, {0});
  EXPECT_NE(first, second);
  EXPECT_EQ(cache.Share(second), first);
  EXPECT_NE(cache.Share(ChainModel(5, {1})), first);
}

TEST(ModelCache, ItHoldsNothingAlive) {
  ModelCache cache;
  std::weak_ptr<const SceneModel> watched;
  {
    const auto model = cache.Share(ChainModel(5));
    watched = model;
    EXPECT_EQ(cache.size(), 1u);
  }
  EXPECT_TRUE(watched.expired());
  EXPECT_EQ(cache.size(), 0u);
  EXPECT_NE(cache.Share(ChainModel(5)), nullptr);
}

TEST(ModelCache, ManyModelsComeAndGo) {
  ModelCache cache;
  std::vector<std::shared_ptr<const SceneModel>> kept;
  for (uint32_t particles = 2; particles < 302; ++particles) {
    auto model = cache.Share(ChainModel(particles));
    if (particles % 10 == 0) kept.push_back(std::move(model));
  }
  EXPECT_EQ(cache.size(), kept.size());
  for (const auto& model : kept) {
    EXPECT_EQ(cache.Share(ChainModel(model->particle_count())), model);
  }
}

}  // namespace
}  // namespace drape
