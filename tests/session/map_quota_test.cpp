#include "server/session/map_quota.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/distance_map.h"
#include "tests/session/session_fixture.h"
#include "tests/support/solids/solids.h"

namespace drape {
namespace {

std::shared_ptr<const DistanceMap> Map(double side_m) {
  return DistanceMap::Build(
             test::BoxMesh(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(side_m)),
             {.resolution = 4})
      .value();
}

std::shared_ptr<MapQuota> Quota(uint64_t max_bytes, std::shared_ptr<MapPool> pool = nullptr,
                                const std::string& owner = "a") {
  if (pool == nullptr) pool = std::make_shared<MapPool>(uint64_t{1} << 30);
  return std::make_shared<MapQuota>(max_bytes, std::move(pool), owner);
}

TEST(MapQuota, AMapCountsOnceWhileItIsHeld) {
  const auto map = Map(1);
  const auto quota = Quota(map->size_bytes());
  auto first = quota->Charge({map}).value();
  auto second = quota->Charge({map}).value();
  EXPECT_EQ(first, second);
  EXPECT_EQ(quota->used_bytes(), map->size_bytes());
  first.clear();
  EXPECT_EQ(quota->used_bytes(), map->size_bytes());
  second.clear();
  EXPECT_EQ(quota->used_bytes(), 0u);
}

TEST(MapQuota, TooMuchIsRefusedAndNothingCharged) {
  const auto small = Map(1);
  const auto other = Map(2);
  const auto quota = Quota(small->size_bytes() + other->size_bytes() - 1);
  const MapCharges held = quota->Charge({small}).value();
  const Status refused = quota->Charge({small, other}).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(refused.message().find("max_mesh_collider_bytes_per_session is " +
                                   std::to_string(small->size_bytes() + other->size_bytes() - 1)),
            std::string::npos);
  EXPECT_EQ(quota->used_bytes(), small->size_bytes());
}

// Maps of one size: the pool has room for 4.
TEST(MapQuota, OwnersLeaveRoomForOthers) {
  const std::vector<std::shared_ptr<const DistanceMap>> maps = {Map(1), Map(2), Map(3), Map(4)};
  const uint64_t bytes = maps[0]->size_bytes();
  for (const auto& map : maps) ASSERT_EQ(map->size_bytes(), bytes);
  const auto pool = std::make_shared<MapPool>(4 * bytes);
  const auto first = Quota(100 * bytes, pool), second = Quota(100 * bytes, pool);
  const MapCharges held = first->Charge({maps[0]}).value();
  const MapCharges same = second->Charge({maps[0]}).value();
  EXPECT_EQ(pool->used_bytes("a"), bytes) << "once for the owner";
  MapCharges more = second->Charge({maps[0], maps[1]}).value();
  const Status refused = first->Charge({maps[2]}).status();
  EXPECT_EQ(refused.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(refused.message().find("max_mesh_collider_bytes"), std::string::npos);
  EXPECT_EQ(first->used_bytes(), bytes) << "nothing was charged";
  const auto other = Quota(100 * bytes, pool, "other");
  const MapCharges others = other->Charge({maps[0]}).value();
  EXPECT_EQ(pool->used_bytes("other"), bytes) << "an equal map of another owner counts, too";
  EXPECT_FALSE(other->Charge({maps[1]}).ok());
  EXPECT_TRUE(Quota(100 * bytes, pool, "third")->Charge({maps[2]}).ok());
  more.clear();
  EXPECT_EQ(pool->used_bytes("a"), bytes);
}

class MapQuotaOfSessions : public SessionFixture {
 protected:
  static ClothCreation ChainsOn(const std::shared_ptr<const DistanceMap>& map, size_t copies) {
    ClothCreation creation = Chains(copies, 3);
    for (ClothCopy& copy : creation.copies) {
      copy.parameters.colliders = {DistanceMapAt(map), DistanceMapAt(map)};
    }
    return creation;
  }
};

TEST_F(MapQuotaOfSessions, ClothsTakeItAndGiveItBack) {
  const auto map = Map(1);
  SessionLimits limits;
  limits.max_mesh_collider_bytes_per_session = map->size_bytes();
  Start(limits);
  const auto created = Create(ChainsOn(map, 3)).value();
  EXPECT_EQ(session().map_bytes(), map->size_bytes());
  EXPECT_EQ(Create(ChainsOn(Map(2), 1)).status().reason(), "QUOTA_EXCEEDED");
  EXPECT_EQ(device_->live_cloths(), 3u);
  EXPECT_TRUE(Create(ChainsOn(map, 1)).ok()) << "the same map costs nothing more";
  EXPECT_TRUE(Delete(Find({})).ok());
  EXPECT_EQ(session().map_bytes(), 0u);
  Inspect([](const FakeBackend&) {});  // the device thread has dropped its references by then
  EXPECT_EQ(map.use_count(), 1) << "nobody holds the map any more";
}

TEST_F(MapQuotaOfSessions, TheSessionsOfATenantShareTheirHalf) {
  const auto map = Map(1);
  SessionLimits limits;
  limits.max_mesh_collider_bytes = 4 * map->size_bytes();
  Start(limits);
  const SessionLease first = registry_->Create(std::nullopt, "1", "tenant").value();
  const SessionLease second = registry_->Create(std::nullopt, "2", "tenant").value();
  EXPECT_TRUE(Create(*first, ChainsOn(map, 1)).ok());
  EXPECT_TRUE(Create(*second, ChainsOn(Map(2), 1)).ok());
  EXPECT_EQ(Create(*second, ChainsOn(Map(3), 1)).status().reason(), "QUOTA_EXCEEDED");
  EXPECT_TRUE(Create(*second, ChainsOn(map, 1)).ok()) << "the tenant has it";
  EXPECT_TRUE(Create(ChainsOn(Map(3), 1)).ok()) << "another owner";
}

TEST_F(MapQuotaOfSessions, OtherCollidersTakeTheirPlace) {
  const auto map = Map(1);
  SessionLimits limits;
  limits.max_mesh_collider_bytes_per_session = map->size_bytes();
  Start(limits);
  const auto created = Create(ChainsOn(map, 1)).value();
  ClothChange change;
  change.colliders = std::vector<Collider>{DistanceMapAt(Map(2))};
  EXPECT_EQ(Update(Find(created.ids), change).status().reason(), "QUOTA_EXCEEDED")
      << "for a moment there would be both";
  change.colliders = std::vector<Collider>{SphereAt({0, 0, 0}, 1)};
  EXPECT_TRUE(Update(Find(created.ids), change).ok());
  EXPECT_EQ(session().map_bytes(), 0u);
  change.colliders = std::vector<Collider>{DistanceMapAt(Map(2))};
  EXPECT_TRUE(Update(Find(created.ids), change).ok());
  EXPECT_GT(session().map_bytes(), 0u);
}

}  // namespace
}  // namespace drape
