#include "server/api/mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/request_validation.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

std::shared_ptr<ClothRecord> Record(const v1::CreateClothsRequest& request, size_t copy) {
  const CheckedCreation checked = CheckCreateCloths(request, {}).value();
  auto description = std::make_shared<ClothDescription>();
  description->model_description = checked.description;
  description->model = SceneModel::Build(*checked.description).value();
  description->parameters = checked.copies[copy].parameters;
  description->pins = checked.pins;
  description->plan = "scalar";
  Placement placement;
  placement.environment_origin_m = checked.copies[copy].environment_origin_m;
  auto record =
      std::make_shared<ClothRecord>(placement, checked.copies[copy].transform, description);
  record->id = ClothId{5, 2};
  return record;
}

// A client can send back the cloth that it has read, and it means the same.
TEST(Mapping, AClothReadsBackAsItWasAskedFor) {
  v1::CreateClothsRequest request = test::GoodCreation();
  const v1::Cloth cloth = ToProto(*Record(request, 1));
  EXPECT_EQ(cloth.id(), (ClothId{5, 2}.Packed()));
  EXPECT_EQ(cloth.shape().particles(), 12u);
  EXPECT_EQ(cloth.shape().plan(), "scalar");
  EXPECT_THAT(cloth.environment_origin_m(), ElementsAre(10, 0, 0));
  EXPECT_EQ(cloth.pins(1).particle(), 3u);
  EXPECT_THAT(cloth.pins(1).target_m(), ElementsAre(0.3, 0.1, 0));
  const v1::Capsule& capsule = cloth.environment().colliders(2).capsule();
  EXPECT_THAT(capsule.a_m(), ElementsAre(-1, -1, 0));
  EXPECT_THAT(capsule.b_m(), ElementsAre(1, -1, 0.5));
  EXPECT_EQ(capsule.radius_m(), 0.25);
  const v1::Box& box = cloth.environment().colliders(3).box();
  EXPECT_THAT(box.center_m(), ElementsAre(2, -1, 0));
  EXPECT_THAT(box.half_extents_m(), ElementsAre(0.5, 0.25, 1));
  EXPECT_THAT(box.rotation_xyzw(),
              ElementsAre(0, DoubleNear(0.6, 1e-15), 0, DoubleNear(0.8, 1e-15)));

  *request.mutable_spec()->mutable_environment() = cloth.environment();
  *request.mutable_spec()->mutable_settings() = cloth.settings();
  *request.mutable_spec()->mutable_pins() = cloth.pins();
  request.clear_overrides();
  const v1::Cloth again = ToProto(*Record(request, 1));
  EXPECT_EQ(again.SerializeAsString(), cloth.SerializeAsString());
}

TEST(Mapping, ReportsNameTheWarningsThatOccurred) {
  StepReport report;
  report.iterations = 17;
  report.converged = false;
  report.measured.max_strain = 0.25;
  report.measured.strain_p50 = 0.125;
  report.measured.strain_p90 = 0.1875;
  report.measured.strain_p99 = 0.21875;
  report.measured.rms_motion_m = 0.375;
  report.measured.lowest_m = -3;
  report.measured.contacts = 4;
  report.measured.near_pairs = 12;
  report.measured.smallest_distance_m = 0.003;
  report.measured.crossings = 5;
  WarningCounters warnings;
  warnings.not_converged = 6;
  warnings.strain_beyond_limit = 2;
  warnings.energy_gained = 3;
  warnings.starts_crossing = 4;
  warnings.contacts_given_up = 5;
  const v1::StepReport message = ToProto(ClothId{1, 1}, 9, report, warnings);
  EXPECT_EQ(message.step(), 9u);
  EXPECT_EQ(message.iterations(), 17u);
  EXPECT_FALSE(message.converged());
  EXPECT_EQ(message.max_strain(), 0.25);
  EXPECT_EQ(message.strain_p50(), 0.125);
  EXPECT_EQ(message.strain_p90(), 0.1875);
  EXPECT_EQ(message.strain_p99(), 0.21875);
  EXPECT_EQ(message.rms_motion_m(), 0.375);
  EXPECT_EQ(message.lowest_m(), -3);
  EXPECT_EQ(message.contacts(), 4u);
  EXPECT_EQ(message.near_pairs(), 12u);
  EXPECT_EQ(message.smallest_distance_m(), 0.003);
  EXPECT_EQ(message.crossings(), 5u);
  EXPECT_FALSE(ToProto(ClothId{1, 1}, 9, StepReport(), warnings).has_smallest_distance_m());
  EXPECT_FALSE(message.faulted());
  EXPECT_EQ(message.fault_reason(), "");
  ASSERT_EQ(message.warnings_size(), 5);
  EXPECT_EQ(message.warnings().at("not_converged"), 6u);
  EXPECT_EQ(message.warnings().at("strain_beyond_limit"), 2u);
  EXPECT_EQ(message.warnings().at("energy_gained"), 3u);
  EXPECT_EQ(message.warnings().at("starts_crossing"), 4u);
  EXPECT_EQ(message.warnings().at("contacts_given_up"), 5u);
}

TEST(Mapping, AStepAnswerNamesFaultedCloths) {
  const auto record = Record(test::GoodCreation(), 0);
  StepOutcome outcome;
  outcome.cloths.resize(2);
  outcome.cloths[0].stamp.completed_steps = 3;
  outcome.cloths[1].stamp = {.completed_steps = 1, .time_s = 0, .fault = FaultReason::kRunaway};
  outcome.cloths[1].report = StepReport{};
  outcome.cloths[1].report->fault = FaultReason::kRunaway;
  outcome.timing.queue_us = 12;
  outcome.timing.batch_requests = 16;
  const v1::StepResponse answer = ToProto({record, record}, outcome);
  EXPECT_THAT(answer.steps(), ElementsAre(3, 1));
  EXPECT_THAT(answer.faulted_cloth_ids(), ElementsAre(record->id.Packed()));
  ASSERT_EQ(answer.reports_size(), 1);
  EXPECT_THAT(answer.reports(0).fault_reason(), testing::HasSubstr("last good state"));
  EXPECT_EQ(answer.timing().queue_us(), 12u);
  EXPECT_EQ(answer.timing().batch_requests(), 16u);
  EXPECT_FALSE(answer.has_states());
}

TEST(Mapping, ASessionShowsItsLease) {
  const v1::Session session = ToProto(SessionView{.name = "sessions/a-b",
                                                  .tenant = "lab",
                                                  .display_name = "my cloths",
                                                  .ttl_s = 300,
                                                  .remaining_s = 12.5,
                                                  .cloth_count = 3,
                                                  .particle_count = 4096});
  EXPECT_EQ(session.name(), "sessions/a-b");
  EXPECT_EQ(session.display_name(), "my cloths");
  EXPECT_EQ(session.ttl_s(), 300);
  EXPECT_EQ(session.remaining_s(), 12.5);
  EXPECT_EQ(session.cloth_count(), 3u);
  EXPECT_EQ(session.particle_count(), 4096u);
}

TEST(Mapping, APictureWithItsCameraBoundsAndRange) {
  render::DrawnPicture picture;
  picture.png = "file";
  picture.camera.eye_m = {1, 2, 3};
  picture.camera.target_m = {4, 5, 6};
  picture.camera.vertical_field_of_view_rad = 0.5;
  picture.bounds_m = {Eigen::Vector3d(-1, -2, -3), Eigen::Vector3d(1, 2, 3)};
  picture.range = {-0.5, 0.5};
  picture.device = "fake";
  const v1::RenderResponse message = ToProto(ClothList(), picture);
  EXPECT_EQ(message.png(), "file");
  EXPECT_THAT(message.camera().eye_m(), testing::ElementsAre(1, 2, 3));
  EXPECT_THAT(message.camera().target_m(), testing::ElementsAre(4, 5, 6));
  EXPECT_THAT(message.camera().up(), testing::ElementsAre(0, 1, 0));
  EXPECT_EQ(message.camera().vertical_field_of_view_rad(), 0.5);
  EXPECT_THAT(message.bounds_m(), testing::ElementsAre(-1, -2, -3, 1, 2, 3));
  EXPECT_THAT(message.range(), testing::ElementsAre(-0.5, 0.5));
  EXPECT_EQ(message.device(), "fake");

  const v1::RenderResponse empty = ToProto(ClothList(), render::DrawnPicture());
  EXPECT_TRUE(empty.bounds_m().empty()) << "around nothing";
  EXPECT_TRUE(empty.range().empty()) << "without a scale";
}

}  // namespace
}  // namespace drape::api
