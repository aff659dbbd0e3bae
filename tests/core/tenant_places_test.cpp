#include "server/core/tenant_places.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>

namespace drape {
namespace {

TEST(TenantPlaces, APlaceIsTakenUntilItsLastHolderIsGone) {
  TenantPlaces places("FULL", {"max_per_tenant", 1}, PlaceLimit{"max", 10}, 50);
  std::shared_ptr<void> place = places.Take("a").value();
  std::shared_ptr<void> copy = place;
  EXPECT_TRUE(places.Take("b").ok());
  place.reset();
  const Status refusal = places.Take("a").status();
  EXPECT_EQ(refusal.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal.reason(), "FULL");
  EXPECT_EQ(refusal.message(), "no place is free: max_per_tenant is 1");
  EXPECT_EQ(refusal.retry_after_ms(), 50);
  copy.reset();
  EXPECT_TRUE(places.Take("a").ok());
}

TEST(TenantPlaces, AllTogetherAreLimitedToo) {
  TenantPlaces places("FULL", {"max_per_tenant", 2}, PlaceLimit{"max", 3}, std::nullopt);
  const auto a = places.Take("a").value();
  const auto b = places.Take("b").value();
  auto c = places.Take("c").value();
  const Status refusal = places.Take("d").status();
  EXPECT_EQ(refusal.message(), "no place is free: max is 3");
  EXPECT_EQ(refusal.retry_after_ms(), std::nullopt);
  c.reset();
  EXPECT_TRUE(places.Take("d").ok());
}

TEST(TenantPlaces, AnEmptyTenantIsCountedInAllAlone) {
  TenantPlaces places("FULL", {"max_per_tenant", 1}, PlaceLimit{"max", 2}, std::nullopt);
  const auto first = places.Take("").value();
  const auto second = places.Take("").value();
  EXPECT_FALSE(places.Take("").ok());
}

TEST(TenantPlaces, APlaceMayOutliveThem) {
  std::optional<TenantPlaces> places;
  places.emplace("FULL", PlaceLimit{"max_per_tenant", 1}, PlaceLimit{"max", 1}, std::nullopt);
  auto place = places->Take("a").value();
  const std::weak_ptr<void> watch = place;
  places.reset();
  EXPECT_FALSE(watch.expired()) << "a place belongs to who took it";
  place.reset();
  EXPECT_TRUE(watch.expired());
}

}  // namespace
}  // namespace drape
