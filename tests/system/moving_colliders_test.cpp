// Colliders that move, over the wire and on every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

class MovingColliders : public testing::TestWithParam<std::string> {
 protected:
  MovingColliders() : session_(NewSession(*stub_)) {}

  // Copies of a sheet of 30 cm at the origin over a sphere 30 cm below it, without gravity.
  v1::CreateClothsRequest SheetOverSphere(uint32_t count) {
    v1::CreateClothsRequest request;
    request.set_session(session_);
    request.set_count(count);
    v1::ClothSpec& spec = *request.mutable_spec();
    v1::Grid* grid = spec.mutable_grid();
    grid->set_columns(7);
    grid->set_rows(7);
    grid->set_width_m(0.3);
    grid->set_height_m(0.3);
    spec.mutable_settings()->set_substeps(8);
    Set(spec.mutable_environment()->mutable_gravity_m_per_s2(), {0, 0, 0});
    v1::Sphere* sphere = spec.mutable_environment()->add_colliders()->mutable_sphere();
    Set(sphere->mutable_center_m(), {0.15, -0.3, 0.15});
    sphere->set_radius_m(0.1);
    return request;
  }

  // Sends the sphere up to `height_m` over `over_s`.
  v1::StepRequest Send(const Ids& ids, double height_m, double over_s, uint32_t steps) {
    v1::StepRequest request = StepsOf(session_, ids, steps);
    v1::ColliderControls* controls = request.mutable_collider_controls();
    controls->add_cloth_ids(ids[0]);
    controls->add_colliders(0);
    Set(controls->mutable_positions_m(), {0.15, height_m, 0.15});
    controls->add_over_s(over_s);
    return request;
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, MovingColliders, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

// The one sphere rises into its sheet and lifts it; the other cloth of the request continues as a
// third one that is stepped alone, bit for bit.
TEST_P(MovingColliders, AControlMovesTheColliderOfOneCloth) {
  const Ids all = Create(*stub_, SheetOverSphere(3));
  const Ids ids = {all[0], all[1]};
  EXPECT_THAT(Get(*stub_, session_, ids[0]).collider_poses(), SizeIs(0));
  v1::StepRequest request = Send(ids, 0.1, 0.5, 15);
  request.set_report(true);
  const v1::StepResponse half = Step(*stub_, request);
  // Half way: at -0.1 m, so that its top touches the sheet.
  const auto poses = Get(*stub_, session_, ids[0]).collider_poses();
  ASSERT_THAT(poses, SizeIs(1));
  EXPECT_NEAR(poses[0].position_m(1), -0.1, 1e-12);
  EXPECT_THAT(poses[0].rotation_xyzw(), ElementsAre(0, 0, 0, 1));
  EXPECT_LE(half.reports(0).max_penetration_m(), 1e-6);

  v1::StepRequest rest = StepsOf(session_, ids, 30);
  rest.set_report(true);
  rest.set_expected_step(15);
  const v1::StepResponse lifted = Step(*stub_, rest);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).collider_poses(0).position_m(1), 0.1);
  EXPECT_GT(lifted.reports(0).kinetic_energy_j(), 0);
  EXPECT_LE(lifted.reports(0).max_penetration_m(), 1e-6);
  Step(*stub_, StepsOf(session_, {all[2]}, 45));
  EXPECT_EQ(Bits(*stub_, session_, {ids[1]}), Bits(*stub_, session_, {all[2]}));
  EXPECT_THAT(Get(*stub_, session_, ids[1]).collider_poses(), SizeIs(0));
}

// However the steps are asked for, a repetition does nothing, and after a reset all is as before.
TEST_P(MovingColliders, RunsAreReproducible) {
  const Ids ids = Create(*stub_, SheetOverSphere(1));
  v1::StepRequest request = Send(ids, 0.1, 0.5, 40);
  request.set_request_id("once");
  Step(*stub_, request);
  const std::string bits = Bits(*stub_, session_, ids);
  Step(*stub_, request);
  EXPECT_EQ(Bits(*stub_, session_, ids), bits);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 40u);

  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.set_all_cloths(true);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_THAT(Get(*stub_, session_, ids[0]).collider_poses(), SizeIs(0));
  Step(*stub_, Send(ids, 0.1, 0.5, 7));
  Step(*stub_, StepsOf(session_, ids, 33));
  EXPECT_EQ(Bits(*stub_, session_, ids), bits);
}

// Velocities of the spec continue from step to step, and start again with a reset.
TEST_P(MovingColliders, MotionOfItsOwnGoesOn) {
  v1::CreateClothsRequest creation = SheetOverSphere(1);
  v1::Collider* sphere = creation.mutable_spec()->mutable_environment()->mutable_colliders(0);
  Set(sphere->mutable_velocity_m_per_s(), {0, 1.5, 0});
  const Ids ids = Create(*stub_, creation);
  v1::StepRequest request = StepsOf(session_, ids, 12);
  request.set_report(true);
  Step(*stub_, request);
  const v1::StepResponse pushed = Step(*stub_, request);
  EXPECT_GT(pushed.reports(0).kinetic_energy_j(), 0);
  EXPECT_LE(pushed.reports(0).max_penetration_m(), 1e-6);
  const v1::Cloth cloth = Get(*stub_, session_, ids[0]);
  EXPECT_NEAR(cloth.collider_poses(0).position_m(1), -0.3 + 1.5 * 0.4, 1e-12);
  EXPECT_THAT(cloth.environment().colliders(0).velocity_m_per_s(), ElementsAre(0, 1.5, 0));
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.set_all_cloths(true);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_EQ(Get(*stub_, session_, ids[0]).collider_poses(0).position_m(1), -0.3);
}

TEST_P(MovingColliders, ControlsOfCollidersThatAreNoneAreRefused) {
  const Ids ids = Create(*stub_, SheetOverSphere(1));
  v1::StepRequest request = Send(ids, 0.1, 0.5, 4);
  request.mutable_collider_controls()->set_colliders(0, 1);
  const auto answer = Call(*stub_, &Stub::Step, request);
  EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(answer.status.error_message(), testing::HasSubstr("collider_controls.colliders[0]"));
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 0u);
}

}  // namespace
}  // namespace drape::test
