#include "server/session/tenant_quota.h"

#include <gtest/gtest.h>

namespace drape {
namespace {

TEST(TenantQuota, ALimitIsNamedAndNothingIsTakenBeyondIt) {
  TenantQuota quota({.max_sessions = 2, .max_cloths = 10, .max_particles = 100});
  EXPECT_TRUE(quota.Take("a", {1, 10, 100}).ok());
  const Status cloths = quota.Take("a", {1, 1, 0});
  EXPECT_EQ(cloths.reason(), "QUOTA_EXCEEDED");
  EXPECT_EQ(cloths.message(), "max_cloths_per_tenant is 10: 10 in use, 1 more wanted");
  EXPECT_EQ(quota.UsedBy("a").sessions, 1u);
  EXPECT_TRUE(quota.Take("a", {1, 0, 0}).ok());
  EXPECT_FALSE(quota.Take("a", {1, 0, 0}).ok());
  EXPECT_FALSE(quota.Take("a", {0, 0, 1}).ok());
  EXPECT_TRUE(quota.Take("b", {1, 10, 100}).ok());
  quota.GiveBack("a", {2, 10, 100});
  EXPECT_EQ(quota.UsedBy("a").cloths, 0u);
  EXPECT_TRUE(quota.Take("a", {2, 10, 100}).ok());
}

// 1 million particles take 160 MB, and a hundred cloths 0.8 MB.
TEST(TenantQuota, StatesOfAllTenantsHaveALimitThatNoneTakesAlone) {
  const TenantQuota::Amount part{0, 100, 1'000'000};
  TenantQuota quota({}, 10 * StateBytes(part));
  int of_alice = 0;
  while (quota.Take("alice", part).ok()) ++of_alice;
  EXPECT_EQ(of_alice, 5) << "what she has is what she leaves free";
  EXPECT_EQ(quota.Take("alice", part).reason(), "QUOTA_EXCEEDED");
  EXPECT_TRUE(quota.Take("bob", {0, 300, 3'000'000}).ok()) << "the first may be more than that";
  EXPECT_TRUE(quota.Take("carol", part).ok());
  EXPECT_TRUE(quota.Take("dora", part).ok());
  const Status full = quota.Take("ella", part);
  EXPECT_EQ(full.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(full.message().find("max_state_bytes is"), std::string::npos);
  quota.GiveBack("bob", {0, 300, 3'000'000});
  EXPECT_TRUE(quota.Take("ella", part).ok());
}

TEST(TenantQuota, CountsTheSurfacesOfWorlds) {
  TenantQuota::Amount apart{.cloths = 1}, in_world{.cloths = 1};
  apart.AddParticles(1'000, false);
  in_world.AddParticles(1'000, true);
  EXPECT_EQ(StateBytes(in_world) - StateBytes(apart), 256'000);
  TenantQuota quota({}, StateBytes(in_world));
  ASSERT_TRUE(quota.Take("", in_world).ok());
  EXPECT_EQ(quota.Take("", apart).reason(), "QUOTA_EXCEEDED");
  quota.GiveBack("", in_world);
  EXPECT_TRUE(quota.Take("", in_world).ok()) << "all of it was given back";
}

TEST(TenantQuota, WithoutTenantsStatesHaveTheWholeLimit) {
  const TenantQuota::Amount part{0, 1, 1'000};
  TenantQuota quota({}, 10 * StateBytes(part));
  int taken = 0;
  while (quota.Take("", part).ok()) ++taken;
  EXPECT_EQ(taken, 10);
}

TEST(TenantQuota, WithoutTenantsThereIsNoOtherLimit) {
  TenantQuota quota({.max_sessions = 1, .max_cloths = 1, .max_particles = 1});
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(quota.Take("", {1, 5, 5}).ok());
}

}  // namespace
}  // namespace drape
