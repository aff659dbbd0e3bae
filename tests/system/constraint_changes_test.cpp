// Constraints that change while cloths run, over the wire and on every backend: added, removed,
// driven in their lengths.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;

class ConstraintChanges : public testing::TestWithParam<std::string> {
 protected:
  ConstraintChanges() : session_(NewSession(*stub_)) {}

  // Copies of three particles in a row, 1 m apart along x, the first pinned; no springs.
  v1::CreateClothsRequest ThreeInARow(uint32_t count) {
    v1::CreateClothsRequest request;
    request.set_session(session_);
    request.set_count(count);
    v1::ClothSpec& spec = *request.mutable_spec();
    *spec.mutable_particles() = ShortChain();
    spec.mutable_particles()->clear_springs();
    spec.add_pins()->set_particle(0);
    spec.mutable_settings()->set_substeps(4);
    return request;
  }

  v1::UpdateClothsRequest UpdateOf(const Ids& ids, std::initializer_list<const char*> paths) {
    v1::UpdateClothsRequest request;
    request.set_session(session_);
    request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
    for (const char* path : paths) request.mutable_update_mask()->add_paths(path);
    return request;
  }

  // x, y, z of all particles of one cloth, then their velocities.
  std::vector<double> Numbers(uint64_t id) {
    std::vector<double> numbers;
    for (const v1::StateChunk& chunk : Read(*stub_, session_, {id})) {
      Append(chunk.positions_m(), numbers);
      Append(chunk.velocities_m_per_s(), numbers);
    }
    return numbers;
  }

  double Length(uint64_t id, size_t i, size_t j) {
    const std::vector<double> p = Numbers(id);
    double sum = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      sum += (p[3 * i + axis] - p[3 * j + axis]) * (p[3 * i + axis] - p[3 * j + axis]);
    }
    return std::sqrt(sum);
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;

 private:
  static void Append(const v1::PackedArray& array, std::vector<double>& numbers) {
    const bool is_double = array.data_type() == v1::PackedArray::FLOAT64;
    const size_t size = is_double ? sizeof(double) : sizeof(float);
    for (size_t at = 0; at < array.data().size(); at += size) {
      if (is_double) {
        double value;
        std::memcpy(&value, array.data().data() + at, size);
        numbers.push_back(value);
      } else {
        float value;
        std::memcpy(&value, array.data().data() + at, size);
        numbers.push_back(value);
      }
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, ConstraintChanges, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

// The state stays; the cut piece falls; another cloth of the same model does not change, bit for
// bit.
TEST_P(ConstraintChanges, AConstraintIsCutAndTiedAgain) {
  const Ids ids = Create(*stub_, ThreeInARow(3));
  Step(*stub_, StepsOf(session_, ids, 5));
  const std::string before = Bits(*stub_, session_, {ids[0]});
  v1::UpdateClothsRequest cut = UpdateOf({ids[0]}, {"particles.distance_constraints"});
  cut.mutable_spec()->mutable_particles()->add_distance_constraints()->set_j(1);
  const auto answer = Call(*stub_, &Stub::UpdateCloths, cut);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_EQ(answer.value.shape().distance_constraints(), 1u);
  EXPECT_EQ(Bits(*stub_, session_, {ids[0]}), before);

  Step(*stub_, StepsOf(session_, {ids[0], ids[1]}, 12));
  Step(*stub_, StepsOf(session_, {ids[2]}, 12));
  EXPECT_EQ(Bits(*stub_, session_, {ids[1]}), Bits(*stub_, session_, {ids[2]}));
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 17u);
  EXPECT_NEAR(Length(ids[0], 0, 1), 1, 1e-4);
  const double apart = Length(ids[0], 1, 2);
  EXPECT_GT(apart, 1.01);

  // Tied again without a length: it is that of the rest shape.
  cut.mutable_spec()->mutable_particles()->add_distance_constraints()->set_i(1);
  cut.mutable_spec()->mutable_particles()->mutable_distance_constraints(1)->set_j(2);
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, cut).status.ok());
  Step(*stub_, StepsOf(session_, {ids[0]}, 60));
  EXPECT_NEAR(Length(ids[0], 1, 2), 1, 0.01);
}

TEST_P(ConstraintChanges, SpringsJointsAndKindsComeAndGo) {
  const Ids ids = Create(*stub_, ThreeInARow(1));
  v1::UpdateClothsRequest update = UpdateOf(
      ids, {"particles.distance_constraints", "particles.springs", "particles.point_joints"});
  v1::Particles& particles = *update.mutable_spec()->mutable_particles();
  v1::DistanceConstraint* rope = particles.add_distance_constraints();
  rope->set_j(1);
  rope->set_rest_length_m(1.5);
  rope->set_kind(v1::DistanceConstraint::AT_MOST);
  v1::PointJoint* joint = particles.add_point_joints();
  joint->set_i(1);
  joint->set_j(2);
  v1::Spring* spring = particles.add_springs();
  spring->set_j(2);
  spring->set_stiffness_n_per_m(1);
  const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_EQ(answer.value.shape().point_joints(), 1u);
  EXPECT_EQ(answer.value.shape().springs(), 1u);
  v1::StepRequest step = StepsOf(session_, ids, 90);
  step.set_report(true);
  const v1::StepResponse stepped = Step(*stub_, step);
  EXPECT_LT(Length(ids[0], 1, 2), 0.02) << "joined";
  EXPECT_LT(Length(ids[0], 0, 1), 1.5 * 1.02) << "held by the rope";
  EXPECT_GT(Length(ids[0], 0, 1), 1.2) << "and not earlier";
  EXPECT_FALSE(stepped.reports(0).faulted());

  v1::UpdateClothsRequest bare = UpdateOf(
      ids, {"particles.distance_constraints", "particles.springs", "particles.point_joints"});
  const auto loose = Call(*stub_, &Stub::UpdateCloths, bare);
  ASSERT_TRUE(loose.status.ok()) << loose.status.error_message();
  EXPECT_EQ(loose.value.shape().distance_constraints() + loose.value.shape().springs() +
                loose.value.shape().point_joints(),
            0u);
  Step(*stub_, StepsOf(session_, ids, 1));
}

TEST_P(ConstraintChanges, MaterialOfAGridMakesAnotherModel) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 2));
  Step(*stub_, StepsOf(session_, ids, 3));
  const std::string before = Bits(*stub_, session_, ids);
  v1::UpdateClothsRequest update = UpdateOf(
      {ids[0]}, {"material.stretch_compliance_m_per_n", "material.bending_stiffness_n_per_m",
                 "material.shear_stiffness_n_per_m"});
  v1::Material& material = *update.mutable_spec()->mutable_material();
  material.set_stretch_compliance_m_per_n(0.05);
  material.set_bending_stiffness_n_per_m(0.01);
  material.set_shear_stiffness_n_per_m(0.01);
  const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_GT(answer.value.shape().springs(), 0u);
  EXPECT_EQ(Bits(*stub_, session_, ids), before);
  v1::StepRequest step = StepsOf(session_, ids, 30);
  step.set_report(true);
  const v1::StepResponse stepped = Step(*stub_, step);
  EXPECT_GT(stepped.reports(0).max_strain(), 2 * stepped.reports(1).max_strain());
}

TEST_P(ConstraintChanges, ModuliOfAGridMakeAnotherModel) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 2));
  const std::string before = Bits(*stub_, session_, ids);
  v1::UpdateClothsRequest update =
      UpdateOf({ids[0]}, {"material.stretch_stiffness_n_per_m", "material.bending_rigidity_n_m",
                          "material.shear_modulus_n_per_m"});
  v1::Material& material = *update.mutable_spec()->mutable_material();
  material.set_stretch_stiffness_n_per_m(20);
  material.set_bending_rigidity_n_m(1e-4);
  material.set_shear_modulus_n_per_m(5);
  const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  // Rods along 8 rows and 8 columns, twists and pairs of diagonals of 49 cells; elements between
  // pins alone are left out.
  EXPECT_GT(answer.value.shape().elastic_elements(), 2 * 8 * 6u + 49);
  EXPECT_LE(answer.value.shape().elastic_elements(), 2 * 8 * 6u + 3 * 49);
  EXPECT_EQ(Bits(*stub_, session_, ids), before);
  v1::StepRequest step = StepsOf(session_, ids, 30);
  step.set_report(true);
  const v1::StepResponse stepped = Step(*stub_, step);
  EXPECT_GT(stepped.reports(0).max_strain(), 2 * stepped.reports(1).max_strain());
  // The compliance excludes the stiffness that the cloth has by now.
  v1::UpdateClothsRequest both = UpdateOf({ids[0]}, {"material.stretch_compliance_m_per_n"});
  both.mutable_spec()->mutable_material()->set_stretch_compliance_m_per_n(0.1);
  const auto refused = Call(*stub_, &Stub::UpdateCloths, both);
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(FieldsOf(refused.status), ElementsAre("spec.material.stretch_stiffness_n_per_m"));
}

// Refused requests have changed nothing: the next steps are those of an untouched cloth.
TEST_P(ConstraintChanges, ARefusalChangesNothing) {
  const Ids ids = Create(*stub_, ThreeInARow(2));
  const Ids sheet = Create(*stub_, HangingSheet(session_, 4));
  Step(*stub_, StepsOf(session_, ids, 2));
  const auto expect_refused = [&](const v1::UpdateClothsRequest& update, const char* field) {
    const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
    EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(FieldsOf(answer.status), ElementsAre(field)) << answer.status.error_message();
  };
  v1::UpdateClothsRequest update = UpdateOf({ids[0]}, {"particles.distance_constraints"});
  v1::DistanceConstraint* constraint =
      update.mutable_spec()->mutable_particles()->add_distance_constraints();
  constraint->set_j(3);
  expect_refused(update, "spec.particles.distance_constraints[0].j");
  constraint->set_j(1);
  constraint->set_rest_length_m(-1);
  expect_refused(update, "spec.particles.distance_constraints[0].rest_length_m");
  constraint->clear_rest_length_m();
  update.mutable_cloth_ids()->Add(sheet[0]);
  expect_refused(update, "spec.particles.distance_constraints");
  v1::UpdateClothsRequest joints = UpdateOf({ids[0]}, {"particles.point_joints"});
  joints.mutable_spec()->mutable_particles()->add_point_joints();
  expect_refused(joints, "spec.particles.point_joints[0].j");
  expect_refused(UpdateOf({ids[0]}, {"material.shear_stiffness_n_per_m"}),
                 "spec.material.shear_stiffness_n_per_m");
  Step(*stub_, StepsOf(session_, ids, 10));
  EXPECT_EQ(Bits(*stub_, session_, {ids[0]}), Bits(*stub_, session_, {ids[1]}));
}

v1::StepRequest Driven(v1::StepRequest request, uint64_t id, uint32_t constraint, double length_m,
                       double over_s) {
  v1::RestLengthControls& controls = *request.mutable_rest_length_controls();
  controls.add_cloth_ids(id);
  controls.add_constraints(constraint);
  controls.add_lengths_m(length_m);
  controls.add_over_s(over_s);
  return request;
}

// Linear in time across requests, changes of pins included; another cloth of the same model does
// not change; a reset brings the lengths of the description back.
TEST_P(ConstraintChanges, ADrivenLengthFollowsItsControl) {
  v1::CreateClothsRequest creation = ThreeInARow(2);
  creation.mutable_spec()->mutable_settings()->set_max_iterations(50);
  Set(creation.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, 0, 0});
  creation.mutable_spec()->mutable_material()->set_damping_per_s(5);
  const Ids ids = Create(*stub_, creation);
  const std::string start = Bits(*stub_, session_, {ids[1]});
  // Half of a second in two requests.
  Step(*stub_, Driven(StepsOf(session_, ids, 15), ids[0], 1, 1.5, 0.5));
  EXPECT_NEAR(Length(ids[0], 1, 2), 1.25, 2e-3);
  v1::UpdateClothsRequest pins = UpdateOf({ids[0]}, {"pins"});
  pins.mutable_spec()->add_pins()->set_particle(1);
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, pins).status.ok());
  Step(*stub_, StepsOf(session_, ids, 15));
  EXPECT_NEAR(Length(ids[0], 1, 2), 1.5, 2e-3);
  EXPECT_NEAR(Length(ids[0], 0, 1), 1, 2e-3);
  Step(*stub_, StepsOf(session_, ids, 5));
  EXPECT_NEAR(Length(ids[0], 1, 2), 1.5, 2e-3);
  EXPECT_EQ(Bits(*stub_, session_, {ids[1]}), start) << "at rest and not driven";

  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.set_all_cloths(true);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  Step(*stub_, StepsOf(session_, ids, 5));
  EXPECT_NEAR(Length(ids[0], 1, 2), 1, 2e-3);
}

TEST_P(ConstraintChanges, AllLengthsScaleAndBadControlsMoveNothing) {
  v1::CreateClothsRequest creation = ThreeInARow(1);
  creation.mutable_spec()->mutable_settings()->set_max_iterations(50);
  creation.mutable_spec()->mutable_material()->set_damping_per_s(5);
  Set(creation.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, 0, 0});
  const Ids ids = Create(*stub_, creation);
  v1::StepRequest request = StepsOf(session_, ids, 30);
  v1::RestLengthScales& scales = *request.mutable_rest_length_scales();
  scales.add_cloth_ids(ids[0]);
  scales.add_scales(0.5);
  scales.add_over_s(0.25);
  Step(*stub_, request);
  EXPECT_NEAR(Length(ids[0], 0, 1), 0.5, 2e-3);
  EXPECT_NEAR(Length(ids[0], 1, 2), 0.5, 2e-3);

  const auto fields_of = [&](const v1::StepRequest& bad) {
    const auto answer = Call(*stub_, &Stub::Step, bad);
    EXPECT_EQ(answer.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    return FieldsOf(answer.status);
  };
  const v1::StepRequest one = StepsOf(session_, ids, 1);
  EXPECT_THAT(fields_of(Driven(one, ids[0], 2, 1, 0)),
              ElementsAre("rest_length_controls.constraints[0]"));
  EXPECT_THAT(fields_of(Driven(one, 77, 0, 1, 0)),
              ElementsAre("rest_length_controls.cloth_ids[0]"));
  EXPECT_THAT(fields_of(Driven(one, ids[0], 0, 0, 0)),
              ElementsAre("rest_length_controls.lengths_m[0]"));
  EXPECT_THAT(fields_of(Driven(one, ids[0], 0, 1, -1)),
              ElementsAre("rest_length_controls.over_s[0]"));
  request.mutable_rest_length_scales()->set_scales(0, 0);
  EXPECT_THAT(fields_of(request), ElementsAre("rest_length_scales.scales[0]"));
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 30u);
}

}  // namespace
}  // namespace drape::test
