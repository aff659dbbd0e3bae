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

TEST(TenantQuota, WithoutTenantsThereIsNoLimit) {
  TenantQuota quota({.max_sessions = 1, .max_cloths = 1, .max_particles = 1});
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(quota.Take("", {1, 5, 5}).ok());
}

}  // namespace
}  // namespace drape
