// StepRequest.impulses through the service, on every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

constexpr double kG = 9.81;

class ImpulseCalls : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  // Sheets of 5 x 5 that hang by an edge above a table, 10 m apart.
  v1::CreateClothsRequest Sheets(uint32_t count) const {
    v1::CreateClothsRequest request = HangingSheet(session_, 5, count);
    v1::Plane& table =
        *request.mutable_spec()->mutable_environment()->add_colliders()->mutable_plane();
    for (const double x : {0.0, -3.0, 0.0}) table.add_point_m(x);
    for (const double x : {0.0, 1.0, 0.0}) table.add_normal(x);
    for (uint32_t k = 0; k < count; ++k) {
      for (const double x : {10.0 * k, 0.0, 0.0}) request.add_environment_origins_m(x);
    }
    return request;
  }
  v1::StepRequest Asking(const Ids& ids, uint32_t steps = 1) const {
    v1::StepRequest request = StepsOf(session_, ids, steps);
    request.set_impulses(true);
    return request;
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};

INSTANTIATE_TEST_SUITE_P(Backends, ImpulseCalls, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(ImpulseCalls, ColumnsNameColliderAndPin) {
  const Ids ids = Create(*stub_, Sheets(2));
  const v1::StepResponse answer = Step(*stub_, Asking(ids, 3));
  EXPECT_THAT(answer.collider_impulses().cloth_ids(), ElementsAre(ids[0], ids[1]));
  EXPECT_THAT(answer.collider_impulses().colliders(), ElementsAre(0u, 0u));
  EXPECT_THAT(answer.collider_impulses().impulses_n_s(), SizeIs(6));
  EXPECT_THAT(answer.collider_impulses().angular_impulses_n_m_s(), SizeIs(6));
  const v1::PinImpulses& pins = answer.pin_impulses();
  EXPECT_THAT(pins.particles(), ElementsAre(0u, 1u, 2u, 3u, 4u, 0u, 1u, 2u, 3u, 4u));
  ASSERT_THAT(pins.impulses_n_s(), SizeIs(30));
  // The same in every environment, as the states are.
  for (int k = 0; k < 15; ++k) EXPECT_EQ(pins.impulses_n_s(k), pins.impulses_n_s(15 + k));
}

TEST_P(ImpulseCalls, NobodyWhoDoesNotAskGetsAny) {
  const Ids ids = Create(*stub_, Sheets(1));
  const v1::StepResponse answer = Step(*stub_, StepsOf(session_, ids, 1));
  EXPECT_FALSE(answer.has_collider_impulses());
  EXPECT_FALSE(answer.has_pin_impulses());
}

TEST_P(ImpulseCalls, SayWhatAGripCarries) {
  v1::CreateClothsRequest creation = Sheets(1);
  creation.mutable_spec()->clear_pins();
  creation.mutable_spec()->set_max_grips(2);
  const Ids ids = Create(*stub_, creation);
  v1::StepRequest request = Asking(ids, 240);
  request.set_grip_states(true);
  v1::GripControls& grips = *request.mutable_grip_controls();
  grips.add_cloth_ids(ids[0]);
  grips.add_slots(1);
  grips.add_actions(v1::GripControls::GRAB_PARTICLE);
  grips.add_particles(12);
  for (int axis = 0; axis < 3; ++axis) grips.add_targets_m(0);
  const v1::StepResponse answer = Step(*stub_, request);
  ASSERT_THAT(answer.grips().impulses_n_s(), SizeIs(6));
  for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(answer.grips().impulses_n_s(axis), 0);
  // A square metre of 0.2 kg hangs on it, nearly still after four seconds.
  EXPECT_LT(answer.grips().impulses_n_s(4), -0.5 * 0.2 * kG / 60);
}

// A sheet that hangs still by a corner pulls the grip with its weight.
TEST_P(ImpulseCalls, AGripOpensAboveItsLargestForce) {
  const double weight_n = 0.2 * kG;
  v1::CreateClothsRequest creation = Sheets(1);
  creation.mutable_spec()->clear_pins();
  creation.mutable_spec()->set_max_grips(1);
  creation.mutable_spec()->mutable_material()->set_damping_per_s(5);
  const Ids ids = Create(*stub_, creation);
  const auto grabbing = [&](double largest_force_n, uint32_t steps) {
    v1::StepRequest request = Asking(ids, steps);
    request.set_grip_states(true);
    v1::GripControls& grips = *request.mutable_grip_controls();
    grips.add_cloth_ids(ids[0]);
    grips.add_slots(0);
    grips.add_actions(v1::GripControls::GRAB_PARTICLE);
    grips.add_particles(0);
    for (int axis = 0; axis < 3; ++axis) grips.add_targets_m(0);
    if (largest_force_n > 0) grips.add_largest_forces_n(largest_force_n);
    return request;
  };
  v1::StepResponse answer = Step(*stub_, grabbing(0, 600));
  ASSERT_THAT(answer.grips().particles(), ElementsAre(0));
  // What still swings after ten seconds has fallen by e^-25; one step has c h / 2 of the weight as
  // damping (method.md), 1 %.
  ASSERT_NEAR(answer.grips().impulses_n_s(1) * -60, weight_n, 0.012 * weight_n);
  answer = Step(*stub_, grabbing(1.02 * weight_n, 60));
  EXPECT_EQ(answer.grips().particles(0), 0) << "it holds";
  answer = Step(*stub_, grabbing(0.98 * weight_n, 1));
  EXPECT_EQ(answer.grips().particles(0), -1) << "it opens when the step ends";
  EXPECT_NEAR(answer.grips().impulses_n_s(1), 0, 1e-12) << "of an open grip";
  // Nobody asks for impulses: the limit holds all the same.
  v1::StepRequest request = grabbing(0.5 * weight_n, 30);
  request.clear_impulses();
  answer = Step(*stub_, request);
  EXPECT_EQ(answer.grips().particles(0), -1);
}

// Sheets of 5 x 5 that lie on a table, ten metres apart.
class ContactCalls : public ImpulseCalls {
 protected:
  Ids Lying(uint32_t count) {
    v1::CreateClothsRequest creation = Sheets(count);
    creation.mutable_spec()->clear_pins();
    v1::Plane& table =
        *creation.mutable_spec()->mutable_environment()->mutable_colliders(0)->mutable_plane();
    table.clear_point_m();
    table.clear_normal();
    for (const double x : {0.0, 0.0, 0.0}) table.add_point_m(x);
    for (const double x : {0.0, 1.0, 0.0}) table.add_normal(x);
    return Create(*stub_, creation);
  }
  v1::StepRequest AskingForContacts(const Ids& ids, uint32_t steps = 1) const {
    v1::StepRequest request = StepsOf(session_, ids, steps);
    request.set_contact_impulses(true);
    return request;
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, ContactCalls, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(ContactCalls, RowsNameParticleAndCollider) {
  const Ids ids = Lying(2);
  const v1::StepResponse answer = Step(*stub_, AskingForContacts(ids, 2));
  EXPECT_FALSE(answer.has_collider_impulses()) << "nobody asked for them";
  const v1::ContactImpulses& contacts = answer.contact_impulses();
  ASSERT_THAT(contacts.particles(), SizeIs(50));
  ASSERT_THAT(contacts.impulses_n_s(), SizeIs(150));
  double sum = 0;
  for (int row = 0; row < 50; ++row) {
    EXPECT_EQ(contacts.cloth_ids(row), ids[row / 25]);
    EXPECT_EQ(contacts.particles(row), static_cast<uint32_t>(row % 25));
    EXPECT_EQ(contacts.colliders(row), 0);
    // The same in every environment, as the states are.
    EXPECT_EQ(contacts.impulses_n_s(3 * row + 1), contacts.impulses_n_s(3 * (row % 25) + 1));
    if (row < 25) sum += contacts.impulses_n_s(3 * row + 1);
  }
  EXPECT_NEAR(sum, 0.2 * kG / 60, 1e-3 * 0.2 * kG / 60);
}

TEST_P(ContactCalls, NobodyWhoDoesNotAskGetsAny) {
  const Ids ids = Lying(1);
  EXPECT_FALSE(Step(*stub_, Asking(ids)).has_contact_impulses());
}

// One that fell asleep when nobody had asked wakes once; then it sleeps on while it is asked.
TEST_P(ContactCalls, ASheetAsleepIsStillCarried) {
  const Ids ids = Lying(1);
  const auto is_asleep_after = [&](v1::StepRequest request) {
    request.set_report(true);
    for (int step = 0; step < 400; ++step) {
      if (Step(*stub_, request).reports(0).asleep()) return true;
    }
    return false;
  };
  ASSERT_TRUE(is_asleep_after(StepsOf(session_, ids, 10)));
  v1::StepRequest request = AskingForContacts(ids);
  request.set_report(true);
  EXPECT_FALSE(Step(*stub_, request).reports(0).asleep()) << "nobody had asked";
  ASSERT_TRUE(is_asleep_after(AskingForContacts(ids)));
  const v1::StepResponse answer = Step(*stub_, request);
  EXPECT_TRUE(answer.reports(0).asleep());
  EXPECT_THAT(answer.contact_impulses().particles(), SizeIs(25));
}

// At rest a sheet sleeps, and pulls as before, whether anybody asked before it slept or not.
TEST_P(ImpulseCalls, ASheetAsleepStillWeighs) {
  for (const bool is_asked : {true, false}) {
    v1::CreateClothsRequest creation = Sheets(1);
    creation.mutable_spec()->mutable_material()->set_damping_per_s(20);
    creation.mutable_spec()->mutable_settings()->set_sleep_motion_m(1e-3);
    const Ids ids = Create(*stub_, creation);
    v1::StepRequest request = is_asked ? Asking(ids, 60) : StepsOf(session_, ids, 60);
    request.set_report(true);
    bool is_asleep = false;
    for (int second = 0; second < 30 && !is_asleep; ++second) {
      is_asleep = Step(*stub_, request).reports(0).asleep();
    }
    ASSERT_TRUE(is_asleep);
    const v1::StepResponse answer = Step(*stub_, Asking(ids));
    double sum = 0;
    for (int pin = 0; pin < 5; ++pin) sum += answer.pin_impulses().impulses_n_s(3 * pin + 1);
    EXPECT_NEAR(sum, -0.2 * kG / 60, 0.05 * 0.2 * kG / 60);
    if (!is_asked) continue;
    EXPECT_TRUE(Step(*stub_, request).reports(0).asleep()) << "nobody woke it";
  }
}

}  // namespace
}  // namespace drape::test
