#include "server/api/grip_control_validation.h"

#include <gtest/gtest.h>

#include "server/api/request_validation.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::ExpectViolation;
using test::GoodStep;

TEST(StepRules, GripControlsAreRead) {
  v1::StepRequest request = GoodStep();
  auto step = CheckStep(request, 10);
  ASSERT_TRUE(step.ok()) << step.status().ToString();
  ASSERT_EQ(step->controls.grips.size(), 4u);
  const GripControl& nearest = step->controls.grips[1].control;
  EXPECT_EQ(nearest.slot, 1u);
  EXPECT_EQ(nearest.action, GripAction::kGrabNearest);
  EXPECT_EQ(nearest.radius_m, 0.25);
  EXPECT_EQ(nearest.place_m, Eigen::Vector3d(0.5, 1, 1.5));
  EXPECT_EQ(step->controls.grips[0].control.particle, 7u);
  EXPECT_EQ(step->controls.grips[2].control.over_s, 0.125);
  EXPECT_EQ(step->controls.grips[3].control.action, GripAction::kRelease);
  // Columns that no row needs may be left out.
  v1::GripControls* grips = request.mutable_grip_controls();
  grips->set_actions(1, v1::GripControls::HOLD);
  grips->clear_radii_m();
  grips->clear_particles();
  grips->clear_over_s();
  step = CheckStep(request, 10);
  ASSERT_TRUE(step.ok()) << step.status().ToString();
  EXPECT_EQ(step->controls.grips[0].control.particle, 0u);
  EXPECT_EQ(step->controls.grips[0].control.largest_force_n, GripTrack::kNoLimit_n);
  for (const double n : {0.0, 2.5, 0.0, 0.0}) grips->add_largest_forces_n(n);
  step = CheckStep(request, 10);
  ASSERT_TRUE(step.ok()) << step.status().ToString();
  EXPECT_EQ(step->controls.grips[0].control.largest_force_n, GripTrack::kNoLimit_n) << "0: none";
  EXPECT_EQ(step->controls.grips[1].control.largest_force_n, 2.5);
}

TEST(StepRules, GripForcesAreAColumnOfNumbersFromZeroOn) {
  v1::StepRequest request = GoodStep();
  v1::GripControls* grips = request.mutable_grip_controls();
  grips->add_largest_forces_n(1);
  ExpectViolation(CheckStep(request, 10).status(), "grip_controls.largest_forces_n",
                  "has 1 elements, needs 4");
  grips->clear_largest_forces_n();
  for (const double n : {0.0, -1.0, 0.0, 0.0}) grips->add_largest_forces_n(n);
  ExpectViolation(CheckStep(request, 10).status(), "grip_controls.largest_forces_n[1]",
                  "-1 is not in [0, ");
}

}  // namespace
}  // namespace drape::api
