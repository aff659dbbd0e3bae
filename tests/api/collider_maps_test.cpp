#include "server/api/collider_maps.h"

#include <gmock/gmock.h>

#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "server/scene/body_mass.h"
#include "server/scene/distance_map.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"
#include "tests/support/plain_settings.h"

namespace drape::api {
namespace {

using test::AddSolid;
using test::BadCase;
using test::ExpectViolation;
using test::GoodCreation;
using test::kNaN;
using test::NameOf;
using test::Set;
using testing::ElementsAre;

using BadCreation = BadCase<v1::CreateClothsRequest>;
class MeshColliderFields : public testing::TestWithParam<BadCreation> {};

TEST_P(MeshColliderFields, AreNamedWithValueAndRange) {
  v1::CreateClothsRequest request = GoodCreation();
  GetParam().spoil(request);
  RequestLimits limits;
  limits.max_mesh_colliders_per_cloth = 3;
  limits.collider_mesh = {.max_vertices = 100, .max_triangles = 10};
  const Status status = CheckCreateCloths(request, limits).status();
  ExpectViolation(status, GetParam().field, GetParam().text);
  EXPECT_EQ(status.violations().size(), 1u) << status.ToString();
}

v1::PackedArray Rows(v1::PackedArray::DataType type, uint32_t rows) {
  return test::Packed<uint32_t>(type, 3, std::vector<uint32_t>(3 * rows));
}

INSTANTIATE_TEST_SUITE_P(
    Cases, MeshColliderFields,
    testing::Values(
        BadCreation{"TransformOfASphere",
                    [](auto& r) {
                      Set(r.mutable_spec()
                              ->mutable_environment()
                              ->mutable_colliders(0)
                              ->mutable_transform()
                              ->mutable_position_m(),
                          {0, 1, 0});
                    },
                    "spec.environment.colliders[0].transform", "belongs to mesh"},
        BadCreation{"Place",
                    [](auto& r) { AddSolid(r).mutable_transform()->set_position_m(1, kNaN); },
                    "spec.environment.colliders[4].transform.position_m[1]", "nan"},
        BadCreation{"Turn",
                    [](auto& r) {
                      Set(AddSolid(r).mutable_transform()->mutable_rotation_xyzw(), {0, 0, 0, 0});
                    },
                    "spec.environment.colliders[4].transform.rotation_xyzw", "not a rotation"},
        BadCreation{"ShortBytes",
                    [](auto& r) {
                      AddSolid(r).mutable_mesh()->mutable_positions_m()->mutable_data()->pop_back();
                    },
                    "spec.environment.colliders[4].mesh.positions_m.data", "has 47 bytes"},
        BadCreation{"NoTriangles", [](auto& r) { AddSolid(r).mutable_mesh()->clear_triangles(); },
                    "spec.environment.colliders[4].mesh.triangles.data_type", "UINT32"},
        BadCreation{"TooFewTriangles",
                    [](auto& r) {
                      *AddSolid(r).mutable_mesh()->mutable_triangles() =
                          Rows(v1::PackedArray::UINT32, 3);
                    },
                    "spec.environment.colliders[4].mesh.triangles", "3 is not in [4, 10]"},
        BadCreation{"TooManyTriangles",
                    [](auto& r) {
                      *AddSolid(r).mutable_mesh()->mutable_triangles() =
                          Rows(v1::PackedArray::UINT32, 11);
                    },
                    "spec.environment.colliders[4].mesh.triangles", "11 is not in [4, 10]"},
        BadCreation{"TooManyVertices",
                    [](auto& r) {
                      *AddSolid(r).mutable_mesh()->mutable_positions_m() =
                          Rows(v1::PackedArray::FLOAT32, 101);
                    },
                    "spec.environment.colliders[4].mesh.positions_m", "101 is not in [4, 100]"},
        BadCreation{"TooManyMeshes",
                    [](auto& r) {
                      for (int k = 0; k < 4; ++k) AddSolid(r);
                    },
                    "spec.environment.colliders", "has 4 meshes, at most 3"}),
    NameOf());

Result<std::vector<ColliderMap>> Build(const v1::CreateClothsRequest& request,
                                       DistanceMapCache& cache,
                                       Interruption* interruption = nullptr) {
  return BuildColliderMaps(FieldPath("spec.environment.colliders"),
                           ReadColliderMeshes(request.spec().environment().colliders()), {},
                           interruption, cache);
}

TEST(ColliderMaps, AMeshOfARequestBecomesAMapAtItsPlace) {
  v1::CreateClothsRequest request = GoodCreation();
  AddSolid(request);
  auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  DistanceMapCache cache;
  const auto maps = Build(request, cache);
  ASSERT_TRUE(maps.ok()) << maps.status().ToString();
  std::vector<Collider>& colliders = checked->copies[1].parameters.colliders;
  std::vector<RigidMotion> motions;
  SetMaps(*maps, colliders, motions);
  EXPECT_TRUE(motions.empty());
  // Of a body the pivot is known now.
  motions.assign(colliders.size(), RigidMotion::AtRest({9, 9, 9}));
  for (Collider& collider : colliders) collider.mass_kg = MapOf(collider) != nullptr ? 1 : 0;
  SetMaps(*maps, colliders, motions);
  for (size_t k = 0; k < colliders.size(); ++k) {
    const Eigen::Vector3d pivot_m =
        colliders[k].is_body() ? CentreOfMass(colliders[k]) : Eigen::Vector3d(9, 9, 9);
    EXPECT_EQ(motions[k].pivot_m, pivot_m);
    EXPECT_EQ(motions[k].position_m, pivot_m);
  }
  EXPECT_EQ(colliders[4].pose.position_m, Eigen::Vector3d(-4, -1, 0));
  EXPECT_EQ(colliders[4].pose.rotation.z(), 1);
  const std::shared_ptr<const DistanceMap> map = MapOf(colliders[4]);
  // Outside the face z = 0, far from its edges.
  EXPECT_NEAR(map->DistanceAt({0.25, 0.25, -0.01}), 0.01, 1e-6);
  EXPECT_EQ(Build(request, cache)->at(0).map, map) << "equal meshes share one map";

  // Clients read meshes back without their arrays, but with the shapes of these.
  ClothParameters parameters = test::PlainParameters();
  parameters.colliders = {colliders[4]};
  const v1::Collider message = EnvironmentToProto(parameters).colliders(0);
  EXPECT_THAT(message.mesh().positions_m().shape(), ElementsAre(4, 3));
  EXPECT_THAT(message.mesh().triangles().shape(), ElementsAre(4, 3));
  EXPECT_TRUE(message.mesh().positions_m().data().empty());
  EXPECT_THAT(message.transform().position_m(), ElementsAre(-4, -1, 0));
  EXPECT_THAT(message.transform().rotation_xyzw(), ElementsAre(0, 0, 1, 0));
}

TEST(ColliderMaps, WhatIsNoSolidIsNamed) {
  DistanceMapCache cache;
  v1::CreateClothsRequest request = GoodCreation();
  v1::Mesh& open = *AddSolid(request).mutable_mesh();
  *open.mutable_triangles() =
      test::Packed<uint32_t>(v1::PackedArray::UINT32, 3, {0, 2, 1, 0, 1, 3, 0, 3, 2, 0, 3, 2});
  ASSERT_TRUE(CheckCreateCloths(request, {}).ok());
  const Status status = Build(request, cache).status();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), testing::HasSubstr("spec.environment.colliders[4].mesh.triangles"));

  request = GoodCreation();
  v1::Mesh& inside_out = *AddSolid(request).mutable_mesh();
  *inside_out.mutable_triangles() =
      test::Packed<uint32_t>(v1::PackedArray::UINT32, 3, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2});
  ExpectViolation(Build(request, cache).status(), "spec.environment.colliders[4].mesh.triangles",
                  "inside out");
}

TEST(ColliderMaps, ABuildStopsOnceNobodyWantsIt) {
  DistanceMapCache cache;
  v1::CreateClothsRequest request = GoodCreation();
  AddSolid(request);
  int asked = 0;
  StopWhenUnwanted interruption([&asked] { return ++asked == 3; });
  EXPECT_THROW((void)Build(request, cache, &interruption), WorkStopped);
  EXPECT_EQ(asked, 3);
}

}  // namespace
}  // namespace drape::api
