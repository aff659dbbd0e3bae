// MeshImport.warp_direction: what is refused, and that every bit of it is kept.
#include <gtest/gtest.h>

#include "server/api/request_validation.h"
#include "server/api/spec_message.h"
#include "server/api/spec_validation.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::BadCase;
using test::ExpectViolation;
using test::GoodCreation;
using test::kNaN;
using test::Mesh;
using test::NameOf;
using test::Set;
using test::Spec;

google::protobuf::RepeatedField<double>* WarpOf(v1::ClothSpec& spec) {
  return spec.mutable_mesh_import()->mutable_warp_direction();
}
google::protobuf::RepeatedField<double>* WarpOfAMesh(v1::CreateClothsRequest& request) {
  Mesh(request);
  return WarpOf(Spec(request));
}

using BadCreation = BadCase<v1::CreateClothsRequest>;
class BadWarps : public testing::TestWithParam<BadCreation> {};

TEST_P(BadWarps, AreRefusedByName) {
  v1::CreateClothsRequest request = GoodCreation();
  GetParam().spoil(request);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_FALSE(checked.ok());
  ExpectViolation(checked.status(), GetParam().field, GetParam().text);
  EXPECT_EQ(checked.status().violations().size(), 1u) << checked.status().ToString();
}

INSTANTIATE_TEST_SUITE_P(Warps, BadWarps,
                         testing::Values(BadCreation{"WarpOfAGrid",
                                                     [](auto& r) {
                                                       Set(WarpOf(Spec(r)), {1, 0, 0});
                                                     },
                                                     "spec.mesh_import.warp_direction",
                                                     "belongs to cloths made of a mesh"},
                                         BadCreation{"WarpWithoutDirection",
                                                     [](auto& r) {
                                                       Set(WarpOfAMesh(r), {0, 1e-9, 0});
                                                     },
                                                     "spec.mesh_import.warp_direction",
                                                     "must be a direction"},
                                         BadCreation{"WarpOfTwoNumbers",
                                                     [](auto& r) {
                                                       Set(WarpOfAMesh(r), {1, 0});
                                                     },
                                                     "spec.mesh_import.warp_direction", "2"},
                                         BadCreation{"WarpNotANumber",
                                                     [](auto& r) {
                                                       Set(WarpOfAMesh(r), {0, kNaN, 0});
                                                     },
                                                     "spec.mesh_import.warp_direction[1]", "nan"}),
                         NameOf());

TEST(Warps, WarpsAreKeptAsTheyAreSaid) {
  v1::CreateClothsRequest request = GoodCreation();
  Mesh(request);
  const auto read = [&] {
    const auto checked = CheckCreateCloths(request, {});
    EXPECT_TRUE(checked.ok()) << checked.status().ToString();
    return checked.ok() ? *checked->description : ModelDescription();
  };
  EXPECT_EQ(read().mesh_import.warp_direction, Eigen::Vector3d::UnitY());
  Set(WarpOf(Spec(request)), {0.1, 0.7, -3});
  const ModelDescription described = read();
  EXPECT_EQ(described.mesh_import.warp_direction, Eigen::Vector3d(0.1, 0.7, -3));
  // A snapshot holds every bit of it.
  *Spec(request).mutable_mesh_import() = ModelToSpec(described).mesh_import();
  EXPECT_EQ(read().mesh_import, described.mesh_import);
}

}  // namespace
}  // namespace drape::api
