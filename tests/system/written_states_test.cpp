// States that clients write, and topology that clients read, on every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;

class WrittenStates : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  v1::WriteStatesRequest Request(const Ids& ids, const std::vector<double>& positions_m) const {
    v1::WriteStatesRequest request;
    request.set_session(session_);
    for (const uint64_t id : ids) request.add_cloth_ids(id);
    *request.mutable_positions_m() = Packed<double>(v1::PackedArray::FLOAT64, 3, positions_m);
    return request;
  }
  grpc::Status Write(const v1::WriteStatesRequest& request) {
    return Call(*stub_, &Stub::WriteStates, request).status;
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, WrittenStates, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

// What was read and is written again is the same, and so is what comes of it.
TEST_P(WrittenStates, GoOnFromThere) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 6, 2);
  for (const double x : {0.0, 0.0, 0.0, 8.0, 0.0, 0.0}) creation.add_environment_origins_m(x);
  const Ids ids = Create(*stub_, creation);
  Step(*stub_, StepsOf(session_, ids, 20));
  const std::vector<v1::StateChunk> chunks = Read(*stub_, session_, {ids[1]});
  ASSERT_EQ(chunks.size(), 1u);
  const std::string before = Bits(*stub_, session_, {ids[1]});
  Step(*stub_, StepsOf(session_, ids, 10));
  ASSERT_NE(Bits(*stub_, session_, {ids[1]}), before);
  v1::WriteStatesRequest request;
  request.set_session(session_);
  request.add_cloth_ids(ids[1]);
  *request.mutable_positions_m() = chunks[0].positions_m();
  *request.mutable_velocities_m_per_s() = chunks[0].velocities_m_per_s();
  const grpc::Status status = Write(request);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(Bits(*stub_, session_, {ids[1]}) == before);
  EXPECT_EQ(Get(*stub_, session_, ids[1]).step(), 30u) << "time goes on";
  Step(*stub_, StepsOf(session_, {ids[1]}, 1));
  EXPECT_NE(Bits(*stub_, session_, {ids[1]}), before);
}

TEST_P(WrittenStates, InTheEnvironmentAtRest) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 2);
  creation.mutable_spec()->clear_pins();
  for (const double x : {100.0, 0.0, 0.0}) creation.add_environment_origins_m(x);
  const Ids ids = Create(*stub_, creation);
  Step(*stub_, StepsOf(session_, ids, 10));
  v1::WriteStatesRequest request = Request(ids, {0, 2, 0, 1, 2, 0, 0, 2, 1, 1, 2, 1});
  request.set_frame(v1::WriteStatesRequest::ENVIRONMENT);
  ASSERT_TRUE(Write(request).ok());
  const v1::StateChunk chunk = Read(*stub_, session_, ids)[0];
  const bool is_double = chunk.positions_m().data_type() == v1::PackedArray::FLOAT64;
  double x = 0;
  float x_float = 0;
  if (is_double) {
    std::memcpy(&x, chunk.positions_m().data().data() + 3 * sizeof(x), sizeof(x));
  } else {
    std::memcpy(&x_float, chunk.positions_m().data().data() + 3 * sizeof(x_float), sizeof(float));
    x = x_float;
  }
  EXPECT_NEAR(x, 101, 1e-5) << "the second particle, in the world";
  EXPECT_EQ(chunk.velocities_m_per_s().data(),
            std::string(chunk.velocities_m_per_s().data().size(), 0));
}

TEST_P(WrittenStates, ClearFaults) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 2);
  creation.mutable_spec()->clear_pins();
  Set(creation.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, -1e11, 0});
  const Ids ids = Create(*stub_, creation);
  ASSERT_THAT(Step(*stub_, StepsOf(session_, ids, 5)).faulted_cloth_ids(), ElementsAre(ids[0]));
  ASSERT_TRUE(Write(Request(ids, {0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 1})).ok());
  EXPECT_FALSE(Get(*stub_, session_, ids[0]).faulted());
}

TEST_P(WrittenStates, WhatIsNoStateIsRefused) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 2, 2));
  const std::string before = Bits(*stub_, session_, ids);
  const std::vector<double> good(12, 0.25);
  const auto fields_of = [&](const v1::WriteStatesRequest& request) {
    const grpc::Status status = Write(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    return FieldsOf(status);
  };
  EXPECT_THAT(fields_of(Request({}, good)), ElementsAre("cloth_ids"));
  EXPECT_THAT(fields_of(Request(ids, good)), ElementsAre("positions_m"));
  std::vector<double> bad = good;
  bad[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(fields_of(Request({ids[0]}, bad)), ElementsAre("positions_m[1]"));
  bad[4] = 1e7;
  EXPECT_THAT(fields_of(Request({ids[0]}, bad)), ElementsAre("positions_m[1]"));
  v1::WriteStatesRequest request = Request({ids[0]}, good);
  *request.mutable_velocities_m_per_s() = Packed<double>(v1::PackedArray::FLOAT64, 3, {1, 2, 3});
  EXPECT_THAT(fields_of(request), ElementsAre("velocities_m_per_s"));
  bad = good;
  bad[11] = -1e6;
  *request.mutable_velocities_m_per_s() = Packed<double>(v1::PackedArray::FLOAT64, 3, bad);
  EXPECT_THAT(fields_of(request), ElementsAre("velocities_m_per_s[3]"));
  request = Request({ids[0]}, good);
  request.mutable_positions_m()->set_data_type(v1::PackedArray::UINT32);
  EXPECT_THAT(fields_of(request), ElementsAre("positions_m.data_type"));
  EXPECT_EQ(Bits(*stub_, session_, ids), before);
}

TEST(ReadTopology, TellsWhatRowsAre) {
  InProcessServer server("cpu");
  const auto stub = server.NewStub();
  v1::CreateClothsRequest creation = GoodCreation();
  creation.set_session(NewSession(*stub));
  AddSolid(creation);
  const uint32_t columns = creation.spec().grid().columns();
  const uint32_t rows = creation.spec().grid().rows();
  const Ids ids = Create(*stub, creation);
  v1::ReadTopologyRequest request;
  request.set_session(creation.session());
  request.set_cloth_id(ids[0]);
  const auto answer = Call(*stub, &Stub::ReadTopology, request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  const v1::Topology& topology = answer.value;
  EXPECT_EQ(topology.particles(), columns * rows);
  EXPECT_EQ(topology.grid_columns(), columns);
  EXPECT_EQ(topology.grid_rows(), rows);
  EXPECT_THAT(topology.rest_positions_m().shape(), ElementsAre(columns * rows, 3));
  EXPECT_THAT(topology.triangles().shape(), ElementsAre(2 * (columns - 1) * (rows - 1), 3));
  EXPECT_EQ(topology.edges().shape(1), 2u);
  EXPECT_EQ(topology.edges().shape(0),
            Get(*stub, creation.session(), ids[0]).shape().distance_constraints());
  EXPECT_EQ(topology.edge_constraints().shape(0), topology.edges().shape(0));
  ASSERT_EQ(topology.collider_meshes_size(), 1);
  EXPECT_EQ(topology.collider_meshes(0).mesh().triangles().data(), SolidMesh().triangles().data());
  request.set_cloth_id(7);
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::ReadTopology, request).status), "CLOTH_NOT_FOUND");
}

}  // namespace
}  // namespace drape::test
