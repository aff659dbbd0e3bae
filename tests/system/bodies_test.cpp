// Colliders with a mass through the service: what a client sees of them, resets, saved states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

class BodyCalls : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  // Sheets that hang by two corners, a brick of 50 g above each, over a table.
  v1::CreateClothsRequest Request(uint32_t count) const {
    v1::CreateClothsRequest request;
    request.set_session(session_);
    request.set_count(count);
    v1::ClothSpec& spec = *request.mutable_spec();
    v1::Grid* grid = spec.mutable_grid();
    grid->set_columns(9);
    grid->set_rows(9);
    grid->set_width_m(0.4);
    grid->set_height_m(0.4);
    spec.add_pins()->set_particle(0);
    spec.add_pins()->set_particle(8);
    spec.mutable_material()->set_friction_static(0.4);
    spec.mutable_material()->set_friction_dynamic(0.3);
    v1::Environment& environment = *spec.mutable_environment();
    v1::Plane* table = environment.add_colliders()->mutable_plane();
    Set(table->mutable_point_m(), {0, -0.6, 0});
    Set(table->mutable_normal(), {0, 1, 0});
    v1::Collider& brick = *environment.add_colliders();
    Set(brick.mutable_box()->mutable_center_m(), {0.2, 0.1, 0.15});
    Set(brick.mutable_box()->mutable_half_extents_m(), {0.05, 0.03, 0.04});
    brick.set_mass_kg(0.05);
    Set(brick.mutable_velocity_m_per_s(), {0, -0.5, 0});
    Set(brick.mutable_angular_velocity_rad_per_s(), {1, 0, 2});
    for (uint32_t k = 0; k < count; ++k) {
      for (const double x : {10.0 * k, 1.0, 0.0}) request.add_environment_origins_m(x);
    }
    return request;
  }
  v1::StepReport Report(const Ids& ids, uint32_t steps) {
    v1::StepRequest request = StepsOf(session_, ids, steps);
    request.set_report(true);
    return Step(*stub_, request).reports(0);
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};

INSTANTIATE_TEST_SUITE_P(Backends, BodyCalls, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });
// In the report in the world, in the cloth in its environment.
TEST_P(BodyCalls, TheReportTellsWhereABodyIs) {
  const Ids ids = Create(*stub_, Request(2));
  const v1::StepReport report = Report({ids[1]}, 3);
  ASSERT_THAT(report.bodies(), SizeIs(1));
  const v1::BodyState& body = report.bodies(0);
  EXPECT_EQ(body.collider(), 1u);
  // Nothing has touched it: a fall of 3/60 s. Roundings of metres.
  const double t = 3.0 / 60;
  EXPECT_NEAR(body.position_m(0), 10.2, 1e-14);
  EXPECT_NEAR(body.position_m(1), 1.1 - 0.5 * t - 9.81 / 2 * t * t, 1e-13);
  EXPECT_NEAR(body.velocity_m_per_s(1), -0.5 - 9.81 * t, 1e-13);
  ASSERT_THAT(body.rotation_xyzw(), SizeIs(4));
  ASSERT_THAT(body.angular_velocity_rad_per_s(), SizeIs(3));
  const v1::Cloth cloth = Get(*stub_, session_, ids[1]);
  ASSERT_THAT(cloth.collider_poses(), SizeIs(2));
  EXPECT_NEAR(cloth.collider_poses(1).position_m(1), body.position_m(1) - 1, 1e-14);
  EXPECT_EQ(cloth.environment().colliders(1).mass_kg(), 0.05);
}

// A reset starts it again; the bits of cloth and body are those of the first time, however many
// steps a request has, and alone or beside others.
TEST_P(BodyCalls, AnEpisodeStartsAgainWithTheSameBits) {
  const Ids ids = Create(*stub_, Request(2));
  const v1::StepReport first = Report({ids[0]}, 40);
  EXPECT_LT(first.bodies(0).position_m(1), 0.95);  // through where the sheet was
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  Report(ids, 7);
  const v1::StepReport again = Report(ids, 33);
  EXPECT_EQ(again.bodies(0).DebugString(), first.bodies(0).DebugString());
}

TEST_P(BodyCalls, SavedStatesGoOnWithTheSameBits) {
  const Ids ids = Create(*stub_, Request(1));
  Step(*stub_, StepsOf(session_, ids, 20));
  v1::SaveStatesRequest save;
  save.set_session(session_);
  save.set_name("falling");
  save.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::SaveStates, save).status.ok());
  const v1::StepReport first = Report(ids, 25);
  const std::string bits = Bits(*stub_, session_, ids);
  v1::LoadStatesRequest load;
  load.set_session(session_);
  load.set_name("falling");
  load.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::LoadStates, load).status.ok());
  const v1::StepReport again = Report(ids, 25);
  EXPECT_EQ(again.bodies(0).DebugString(), first.bodies(0).DebugString());
  EXPECT_EQ(Bits(*stub_, session_, ids), bits);
}

TEST_P(BodyCalls, NoControlMovesABody) {
  const Ids ids = Create(*stub_, Request(1));
  v1::StepRequest request = StepsOf(session_, ids, 1);
  v1::ColliderControls* controls = request.mutable_collider_controls();
  controls->add_cloth_ids(ids[0]);
  controls->add_colliders(1);
  Set(controls->mutable_positions_m(), {0, 1, 0});
  const auto answer = Call(*stub_, &Stub::Step, request);
  EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(answer.status.error_message(), HasSubstr("has a mass"));
}

}  // namespace
}  // namespace drape::test
