#include "server/session/map_quota.h"

#include <gtest/gtest.h>

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

TEST(MapQuota, AMapCountsOnceWhileItIsHeld) {
  const auto map = Map(1);
  const auto quota = std::make_shared<MapQuota>(map->size_bytes());
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
  const auto quota = std::make_shared<MapQuota>(small->size_bytes() + other->size_bytes() - 1);
  const MapCharges held = quota->Charge({small}).value();
  const Status refused = quota->Charge({small, other}).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.reason(), "QUOTA_EXCEEDED");
  EXPECT_NE(refused.message().find("max_mesh_collider_bytes_per_session is " +
                                   std::to_string(small->size_bytes() + other->size_bytes() - 1)),
            std::string::npos);
  EXPECT_EQ(quota->used_bytes(), small->size_bytes());
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
