// Grips through the service, on every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

// A row of a table of grips.
struct GripRow {
  uint64_t cloth;
  uint32_t slot;
  v1::GripControls::Action action;
  std::vector<double> target_m;
  uint32_t particle = 0;
  double radius_m = 0;
  double over_s = 0;
};

class Grips : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  // Sheets of 0.3 m with 5 x 5 particles, free to fall, in environments 10 m apart.
  v1::CreateClothsRequest Sheets(uint32_t count, uint32_t max_grips = 2) const {
    v1::CreateClothsRequest request = HangingSheet(session_, 5, count);
    v1::ClothSpec& spec = *request.mutable_spec();
    spec.clear_pins();
    spec.mutable_grid()->set_width_m(0.4);
    spec.mutable_grid()->set_height_m(0.4);
    spec.set_max_grips(max_grips);
    for (uint32_t k = 0; k < count; ++k) {
      for (const double x : {10.0 * k, 0.0, 0.0}) request.add_environment_origins_m(x);
    }
    return request;
  }

  v1::StepRequest Controlled(const Ids& ids, const std::vector<GripRow>& rows,
                             uint32_t steps = 1) const {
    v1::StepRequest request = StepsOf(session_, ids, steps);
    request.set_grip_states(true);
    request.mutable_view()->set_positions(true);
    request.mutable_view()->set_velocities(true);
    v1::GripControls* table = request.mutable_grip_controls();
    for (const GripRow& row : rows) {
      table->add_cloth_ids(row.cloth);
      table->add_slots(row.slot);
      table->add_actions(row.action);
      table->add_particles(row.particle);
      table->add_radii_m(row.radius_m);
      for (const double x : row.target_m) table->add_targets_m(x);
      table->add_over_s(row.over_s);
    }
    return request;
  }

  // Coordinate `axis` of a particle of the first cloth of an answer, in the world.
  static double At(const v1::PackedArray& array, uint32_t row, uint32_t axis) {
    const size_t index = 3 * size_t{row} + axis;
    if (array.data_type() == v1::PackedArray::FLOAT64) {
      double value;
      std::memcpy(&value, array.data().data() + index * sizeof(value), sizeof(value));
      return value;
    }
    float value;
    std::memcpy(&value, array.data().data() + index * sizeof(value), sizeof(value));
    return value;
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, Grips, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(Grips, GrabMoveAndRelease) {
  const Ids ids = Create(*stub_, Sheets(1));
  EXPECT_EQ(Get(*stub_, session_, ids[0]).max_grips(), 2u);
  // Particle 24 is at (0.4, 0, 0.4); the grip is 0.1 m above it and keeps that distance.
  v1::StepResponse answer =
      Step(*stub_, Controlled(ids,
                              {{ids[0], 1, v1::GripControls::GRAB_PARTICLE, {0.4, 0.1, 0.4}, 24},
                               {ids[0], 1, v1::GripControls::HOLD, {0.4, 0.6, 0.4}, 0, 0, 0.5}},
                              30));
  EXPECT_THAT(answer.grips().cloth_ids(), ElementsAre(ids[0], ids[0]));
  EXPECT_THAT(answer.grips().slots(), ElementsAre(0u, 1u));
  EXPECT_THAT(answer.grips().particles(), ElementsAre(-1, 24));
  EXPECT_NEAR(answer.grips().positions_m(4), 0.5, 1e-12);
  EXPECT_NEAR(At(answer.states().positions_m(), 24, 1), 0.5, 1e-6);
  EXPECT_NEAR(At(answer.states().velocities_m_per_s(), 24, 1), 1, 1e-3);
  EXPECT_LT(At(answer.states().positions_m(), 0, 1), 0.3) << "the rest hangs";
  const double y = At(answer.states().positions_m(), 24, 1);
  answer = Step(*stub_, Controlled(ids, {{ids[0], 1, v1::GripControls::RELEASE, {0, 0, 0}}}));
  EXPECT_THAT(answer.grips().particles(), ElementsAre(-1, -1));
  EXPECT_NE(At(answer.states().positions_m(), 24, 1), y);
  answer = Step(*stub_, Controlled(ids, {}, 40));
  EXPECT_LT(At(answer.states().positions_m(), 24, 1), y - 1);
}

TEST_P(Grips, TheNearestFreeParticleIsGrabbed) {
  v1::CreateClothsRequest creation = Sheets(2);
  creation.mutable_spec()->add_pins()->set_particle(0);
  const Ids ids = Create(*stub_, creation);
  const auto nearest = v1::GripControls::GRAB_NEAREST;
  // Targets are in each environment. 0 is pinned, so 1 is next, then 5; beyond the radius, none.
  const v1::StepResponse answer =
      Step(*stub_, Controlled(ids, {{ids[0], 0, nearest, {0.01, 0, 0}, 0, 0.1},
                                    {ids[0], 1, nearest, {0.01, 0, 0}, 0, 0.11},
                                    {ids[1], 0, nearest, {0.41, 0, 0.4}, 0, 0.02},
                                    {ids[1], 1, nearest, {0.45, 0, 0}, 0, 0.04}}));
  EXPECT_THAT(answer.grips().particles(), ElementsAre(1, 5, 24, -1));
  EXPECT_NEAR(answer.grips().positions_m(0), 0.1, 1e-7);
  EXPECT_NEAR(answer.grips().positions_m(6), 0.4, 1e-7) << "not in the world";
}

// Cloths that hold, and cloths that do not, go on as if alone.
TEST_P(Grips, NoBitDependsOnTheBatch) {
  const auto grab = [](uint64_t id, uint32_t particle) {
    return GripRow{id, 0, v1::GripControls::GRAB_PARTICLE, {0, 0, 0}, particle};
  };
  const Ids ids = Create(*stub_, Sheets(7));
  std::vector<GripRow> rows;
  for (uint32_t k = 1; k < 6; ++k) rows.push_back(grab(ids[k], 3 * k));
  Step(*stub_, Controlled(ids, rows, 5));
  const Ids alone = Create(*stub_, Sheets(2));
  Step(*stub_, Controlled({alone[0]}, {grab(alone[0], 6)}, 5));
  Step(*stub_, Controlled({alone[1]}, {}, 5));
  // Worlds differ by the environments, velocities do not.
  const auto velocities = [&](uint64_t id) {
    return Read(*stub_, session_, {id})[0].velocities_m_per_s().data();
  };
  EXPECT_TRUE(velocities(ids[2]) == velocities(alone[0]));
  EXPECT_TRUE(velocities(ids[6]) == velocities(alone[1]));
}

TEST_P(Grips, ResetOpensAndUpdatesKeepThem) {
  const Ids ids = Create(*stub_, Sheets(1));
  const std::string start = Bits(*stub_, session_, ids);
  Step(*stub_, Controlled(ids,
                          {{ids[0], 0, v1::GripControls::GRAB_PARTICLE, {0, 0, 0}, 0},
                           {ids[0], 1, v1::GripControls::GRAB_PARTICLE, {0, 0, 0}, 4}},
                          3));
  v1::UpdateClothsRequest update;
  update.set_session(session_);
  update.add_cloth_ids(ids[0]);
  update.mutable_update_mask()->add_paths("environment.gravity_m_per_s2");
  update.mutable_update_mask()->add_paths("pins");
  update.mutable_update_mask()->add_paths("material.bending_rigidity_n_m");
  update.mutable_spec()->add_pins()->set_particle(4);
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  const v1::StepResponse answer = Step(*stub_, Controlled(ids, {}, 2));
  EXPECT_THAT(answer.grips().particles(), ElementsAre(0, -1)) << "4 is a pin now";
  EXPECT_EQ(At(answer.states().positions_m(), 0, 1), 0);
  update.clear_update_mask();
  update.mutable_update_mask()->add_paths("pins");
  update.mutable_spec()->clear_pins();
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_EQ(Bits(*stub_, session_, ids), start);
  const v1::StepResponse after = Step(*stub_, Controlled(ids, {}, 20));
  EXPECT_THAT(after.grips().particles(), ElementsAre(-1, -1));
  EXPECT_LT(At(after.states().positions_m(), 0, 1), -0.3);
}

TEST_P(Grips, BadRowsAreRefusedAndNothingMoves) {
  const Ids ids = Create(*stub_, Sheets(1));
  const std::string before = Bits(*stub_, session_, ids);
  const auto fields_of = [&](const GripRow& row) {
    const auto answer = Call(*stub_, &Stub::Step, Controlled(ids, {row}));
    EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    return FieldsOf(answer.status);
  };
  const auto grab = v1::GripControls::GRAB_PARTICLE;
  EXPECT_THAT(fields_of({ids[0], 2, grab, {0, 0, 0}, 0}), ElementsAre("grip_controls.slots[0]"));
  EXPECT_THAT(fields_of({ids[0], 0, grab, {0, 0, 0}, 25}),
              ElementsAre("grip_controls.particles[0]"));
  EXPECT_THAT(fields_of({42, 0, grab, {0, 0, 0}, 0}), ElementsAre("grip_controls.cloth_ids[0]"));
  EXPECT_EQ(Bits(*stub_, session_, ids), before);
  const Ids pinned = Create(*stub_, HangingSheet(session_));
  const auto no_grips =
      Call(*stub_, &Stub::Step, Controlled(pinned, {{pinned[0], 0, grab, {0, 0, 0}}}));
  EXPECT_THAT(FieldsOf(no_grips.status), ElementsAre("grip_controls.slots[0]"));
  EXPECT_THAT(Step(*stub_, Controlled(pinned, {})).grips().slots(), SizeIs(0));
}

}  // namespace
}  // namespace drape::test
