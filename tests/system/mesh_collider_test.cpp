// Mesh colliders over the wire: created with a cloth, put under a running one, refused, drawn.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A slab of 1 m x 0.3 m, `height_m` high, its top at y = 0.
v1::Mesh SlabMesh(float height_m) {
  std::vector<float> positions;
  for (const float x : {-0.5f, 0.5f}) {
    for (const float y : {-height_m, 0.0f}) {
      for (const float z : {-0.15f, 0.15f}) positions.insert(positions.end(), {x, y, z});
    }
  }
  v1::Mesh mesh;
  *mesh.mutable_positions_m() = Packed<float>(v1::PackedArray::FLOAT32, 3, positions);
  *mesh.mutable_triangles() = Packed<uint32_t>(
      v1::PackedArray::UINT32, 3, {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                                   2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3});
  return mesh;
}

// 135 x 15 x 46 samples of 4 bytes and 1 kB of mesh: two slabs fit into this.
constexpr char kQuota[] = "--max-mesh-collider-bytes-per-session=750000";

class MeshColliders : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    stub_ = server_.NewStub();
    session_ = NewSession(*stub_);
  }

  // A free sheet of 5 x 5 particles, 0.2 m wide, in the middle above y = 0.
  v1::CreateClothsRequest Sheet() {
    v1::CreateClothsRequest request = HangingSheet(session_, 5);
    v1::ClothSpec& spec = *request.mutable_spec();
    spec.clear_pins();
    spec.mutable_grid()->set_width_m(0.2);
    spec.mutable_grid()->set_height_m(0.2);
    Set(spec.mutable_transform()->mutable_position_m(), {-0.1, 0.05, -0.1});
    return request;
  }

  static v1::Collider& AddSlab(v1::ClothSpec& spec, float height_m = 0.06f) {
    v1::Collider& collider = *spec.mutable_environment()->add_colliders();
    *collider.mutable_mesh() = SlabMesh(height_m);
    return collider;
  }

  v1::UpdateClothsRequest Colliders(const Ids& ids) {
    v1::UpdateClothsRequest update;
    update.set_session(session_);
    update.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
    update.mutable_update_mask()->add_paths("environment.colliders");
    return update;
  }

  // Expects every particle at this height.
  void ExpectHeights(const Ids& ids, float height_m) {
    for (const v1::StateChunk& chunk : Read(*stub_, session_, ids)) {
      std::vector<float> positions(chunk.positions_m().data().size() / sizeof(float));
      std::memcpy(positions.data(), chunk.positions_m().data().data(),
                  chunk.positions_m().data().size());
      for (size_t k = 1; k < positions.size(); k += 3) {
        // Roundings of coordinates below 1 m in the gap, the advance and the frame.
        EXPECT_NEAR(positions[k], height_m, 128 * 0x1p-24) << k / 3;
      }
    }
  }

  ServerProcess server_{{kQuota}};
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

TEST_F(MeshColliders, ASheetComesToLieOnAMeshAtItsPlace) {
  v1::CreateClothsRequest request = Sheet();
  v1::Collider& slab = AddSlab(*request.mutable_spec());
  Set(slab.mutable_transform()->mutable_position_m(), {0, -0.25, 0});
  Set(slab.mutable_transform()->mutable_rotation_xyzw(), {0, 1, 0, 1});
  const Ids ids = Create(*stub_, request);
  Step(*stub_, StepsOf(session_, ids, 60));
  ExpectHeights(ids, -0.25f);
  // The answer tells shapes and place, not the arrays.
  const v1::Collider shown = Get(*stub_, session_, ids[0]).environment().colliders(0);
  EXPECT_THAT(shown.mesh().positions_m().shape(), ElementsAre(8, 3));
  EXPECT_THAT(shown.mesh().triangles().shape(), ElementsAre(12, 3));
  EXPECT_THAT(shown.transform().position_m(), ElementsAre(0, -0.25, 0));
}

TEST_F(MeshColliders, AMeshPutUnderARunningClothCatchesIt) {
  const Ids ids = Create(*stub_, Sheet());
  Step(*stub_, StepsOf(session_, ids, 6));  // 5 cm down, where it began to fall
  v1::UpdateClothsRequest update = Colliders(ids);
  Set(AddSlab(*update.mutable_spec()).mutable_transform()->mutable_position_m(), {0, -0.5, 0});
  const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  Step(*stub_, StepsOf(session_, ids, 60));
  ExpectHeights(ids, -0.5f);
}

TEST_F(MeshColliders, WhatIsNoSolidIsRefusedAndNothingHasChanged) {
  v1::CreateClothsRequest request = Sheet();
  request.set_validate_only(true);
  v1::Mesh& open = *AddSlab(*request.mutable_spec()).mutable_mesh();
  open.mutable_triangles()->set_shape(0, 11);
  open.mutable_triangles()->mutable_data()->resize(11 * 12);
  const auto refused = Call(*stub_, &Stub::CreateCloths, request);
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.status.error_message(), HasSubstr("exactly 2 in a closed mesh"));
  EXPECT_THAT(FieldsOf(refused.status),
              testing::Each(HasSubstr("spec.environment.colliders[0].mesh.triangles")));

  const Ids ids = Create(*stub_, Sheet());
  v1::UpdateClothsRequest update = Colliders(ids);
  *update.mutable_spec() = request.spec();
  EXPECT_EQ(Call(*stub_, &Stub::UpdateCloths, update).status.error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).environment().colliders_size(), 0);
}

TEST_F(MeshColliders, TheirMemoryIsASessionsQuota) {
  v1::CreateClothsRequest request = Sheet();
  AddSlab(*request.mutable_spec());
  Ids ids = Create(*stub_, request);
  ids.push_back(Create(*stub_, request)[0]);  // the same mesh again: no more memory
  AddSlab(*request.mutable_spec(), 0.061f);
  ids.push_back(Create(*stub_, request)[0]);
  AddSlab(*request.mutable_spec(), 0.062f);
  const auto refused = Call(*stub_, &Stub::CreateCloths, request);
  EXPECT_EQ(ReasonOf(refused.status), "QUOTA_EXCEEDED");
  EXPECT_THAT(refused.status.error_message(),
              HasSubstr("max_mesh_collider_bytes_per_session is 750000"));
  v1::DeleteClothsRequest deletion;
  deletion.set_session(session_);
  deletion.add_cloth_ids(ids[2]);
  EXPECT_TRUE(Call(*stub_, &Stub::DeleteCloths, deletion).status.ok());
  request.mutable_spec()->mutable_environment()->mutable_colliders()->DeleteSubrange(1, 1);
  Create(*stub_, request);
}

TEST_F(MeshColliders, LimitsArePublished) {
  const v1::ServerInfo::Limits limits =
      Call(*stub_, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value.limits();
  EXPECT_EQ(limits.max_mesh_colliders_per_cloth(), 16u);
  EXPECT_EQ(limits.max_triangles_per_mesh_collider(), 131072u);
  EXPECT_EQ(limits.max_mesh_collider_bytes_per_session(), 750000u);
}

}  // namespace
}  // namespace drape::test
