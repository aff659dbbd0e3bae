#include "server/api/joint_message.h"

#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::BadCase;
using test::ExpectViolation;
using test::GoodCreation;
using test::kNaN;
using test::NameOf;
using test::Set;
using test::Spec;

// A good creation whose sphere is a body that hangs on a rope over two pulleys to the plane, on one
// to the environment, and on a point of the capsule.
v1::CreateClothsRequest WithJoints() {
  v1::CreateClothsRequest request = GoodCreation();
  v1::Collider& ball = *Spec(request).mutable_environment()->mutable_colliders(0);
  ball.set_mass_kg(2);
  v1::BodyJoint& over_pulleys = *ball.add_joints();
  Set(over_pulleys.mutable_point_m(), {0, -0.5, 0});
  over_pulleys.set_collider(1);
  over_pulleys.set_rope_length_m(3.5);
  Set(over_pulleys.mutable_other_point_m(), {1, -1.5, 0});
  Set(over_pulleys.mutable_pulleys_m(), {0, 0, 0, 1, 0, 0});
  v1::BodyJoint& rope = *ball.add_joints();
  Set(rope.mutable_point_m(), {0, -0.5, 0});
  rope.set_rope_length_m(1);
  Set(rope.mutable_other_point_m(), {0, 0.5, 0});  // exactly taut
  v1::BodyJoint& point = *ball.add_joints();
  Set(point.mutable_point_m(), {0.5, -1, 0.25});
  point.set_collider(2);
  return request;
}

v1::BodyJoint& Joint(v1::CreateClothsRequest& request, int j) {
  return *Spec(request).mutable_environment()->mutable_colliders(0)->mutable_joints(j);
}

TEST(JointMessage, IsReadAndWritten) {
  const auto checked = CheckCreateCloths(WithJoints(), {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const ClothParameters& parameters = checked->copies[0].parameters;
  const std::vector<BodyJoint>& joints = parameters.colliders[0].joints;
  ASSERT_EQ(joints.size(), 3u);
  EXPECT_EQ(joints[0].collider, 1u);
  EXPECT_EQ(joints[0].rope_length_m, 3.5);
  EXPECT_EQ(joints[0].other_point_m, Eigen::Vector3d(1, -1.5, 0));
  ASSERT_EQ(joints[0].pulleys_m.size(), 2u);
  EXPECT_EQ(joints[0].pulleys_m[1], Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(joints[1].collider, std::nullopt);
  EXPECT_FALSE(joints[2].is_rope());
  EXPECT_EQ(joints[2].point_m, Eigen::Vector3d(0.5, -1, 0.25));
  EXPECT_EQ(joints[2].other_point_m, joints[2].point_m);
  EXPECT_EQ(joints[2].collider, 2u);
  const v1::Collider written = EnvironmentToProto(parameters).colliders(0);
  Violations violations;
  EXPECT_EQ(CheckJoints("joints", written.joints(), 0, 4, violations), joints);
  EXPECT_TRUE(violations.is_empty());
}

using BadCreation = BadCase<v1::CreateClothsRequest>;
class JointMessage : public testing::TestWithParam<BadCreation> {};

TEST_P(JointMessage, NamesFieldValueAndRange) {
  v1::CreateClothsRequest request = WithJoints();
  GetParam().spoil(request);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_FALSE(checked.ok());
  ExpectViolation(checked.status(), "spec.environment.colliders[" + GetParam().field,
                  GetParam().text);
  EXPECT_EQ(checked.status().violations().size(), 1u) << checked.status().ToString();
}

INSTANTIATE_TEST_SUITE_P(
    All, JointMessage,
    testing::Values(
        BadCreation{
            "NoBody",
            [](auto& r) { Spec(r).mutable_environment()->mutable_colliders(0)->clear_mass_kg(); },
            "0].joints", "belong to bodies"},
        BadCreation{"NoPoint", [](auto& r) { Joint(r, 2).clear_point_m(); }, "0].joints[2].point_m",
                    "needs 3"},
        BadCreation{"PointIsNoNumber", [](auto& r) { Joint(r, 2).mutable_point_m()->Set(1, kNaN); },
                    "0].joints[2].point_m[1]", "nan"},
        BadCreation{"OtherColliderIsNone", [](auto& r) { Joint(r, 2).set_collider(4); },
                    "0].joints[2].collider", "4 is not below the number of colliders, 4"},
        BadCreation{"OtherColliderIsItself", [](auto& r) { Joint(r, 2).set_collider(0); },
                    "0].joints[2].collider", "another one is needed"},
        BadCreation{"PulleysOfAPointJoint",
                    [](auto& r) {
                      Set(Joint(r, 2).mutable_pulleys_m(), {0, 0, 0});
                    },
                    "0].joints[2].pulleys_m", "belongs to ropes"},
        BadCreation{"OtherPointOfAPointJoint",
                    [](auto& r) {
                      Set(Joint(r, 2).mutable_other_point_m(), {0, 0, 0});
                    },
                    "0].joints[2].other_point_m", "belongs to ropes"},
        BadCreation{"RopeWithoutEnd", [](auto& r) { Joint(r, 1).clear_other_point_m(); },
                    "0].joints[1].other_point_m", "needs 3"},
        BadCreation{"RopeWithoutLength", [](auto& r) { Joint(r, 1).set_rope_length_m(0); },
                    "0].joints[1].rope_length_m", "[1e-06, 1e+06] m"},
        BadCreation{"RopeIsTooShort", [](auto& r) { Joint(r, 0).set_rope_length_m(2.75); },
                    "0].joints[0].rope_length_m", "2.75 m is shorter than the way"},
        BadCreation{"HalfAPulley",
                    [](auto& r) {
                      Set(Joint(r, 0).mutable_pulleys_m(), {0, 0, 0, 1});
                    },
                    "0].joints[0].pulleys_m", "has 4 numbers, 3 per pulley"},
        BadCreation{"TooManyPulleys",
                    [](auto& r) {
                      Joint(r, 0).clear_pulleys_m();
                      for (int k = 0; k < 27; ++k) Joint(r, 0).add_pulleys_m(0);
                    },
                    "0].joints[0].pulleys_m", "has 9 elements, at most 8"},
        BadCreation{"TooManyJoints",
                    [](auto& r) {
                      for (int k = 0; k < 6; ++k) {
                        *Spec(r).mutable_environment()->mutable_colliders(0)->add_joints() =
                            Joint(r, 2);
                      }
                    },
                    "0].joints", "has 9 elements, at most 8"}),
    NameOf());

}  // namespace
}  // namespace drape::api
