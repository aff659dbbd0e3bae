// Cloths that start again elsewhere, with other parameters, and as part of a step; parameters of
// each cloth of its own. On every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;

class Resets : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  Ids Sheets(uint32_t count) {
    v1::CreateClothsRequest request = HangingSheet(session_, 4, count);
    request.mutable_spec()->clear_pins();
    return Create(*stub_, request);
  }
  // The y of the first particle of each cloth.
  std::vector<double> Heights(const Ids& ids) {
    std::vector<double> heights;
    for (const uint64_t id : ids) {
      const v1::PackedArray array = Read(*stub_, session_, {id})[0].positions_m();
      if (array.data_type() == v1::PackedArray::FLOAT64) {
        double value;
        std::memcpy(&value, array.data().data() + sizeof(value), sizeof(value));
        heights.push_back(value);
      } else {
        float value;
        std::memcpy(&value, array.data().data() + sizeof(value), sizeof(value));
        heights.push_back(value);
      }
    }
    return heights;
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, Resets, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(Resets, ElsewhereAndUnderOtherGravity) {
  const Ids ids = Sheets(2);
  const std::string start = Bits(*stub_, session_, ids);
  Step(*stub_, StepsOf(session_, ids, 3));
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  for (const uint64_t id : ids) reset.add_cloth_ids(id);
  for (const double height_m : {2.0, 5.0}) {
    for (const double x : {0.0, height_m, 0.0, 0.0, 0.0, 0.0, 1.0}) reset.add_transforms(x);
    Set(reset.add_overrides()->mutable_gravity_m_per_s2(), {0, height_m, 0});
  }
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_THAT(Heights(ids),
              ElementsAre(testing::DoubleNear(2, 1e-6), testing::DoubleNear(5, 1e-6)));
  EXPECT_EQ(Get(*stub_, session_, ids[1]).environment().gravity_m_per_s2(1), 5);
  Step(*stub_, StepsOf(session_, ids, 60));
  // g t^2 / 2 after 1 s, exact for free fall.
  EXPECT_THAT(Heights(ids),
              ElementsAre(testing::DoubleNear(3, 1e-4), testing::DoubleNear(7.5, 1e-4)));
  // The transform was for once, the parameters stay.
  reset.clear_transforms();
  reset.clear_overrides();
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_EQ(Bits(*stub_, session_, ids), start);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).environment().gravity_m_per_s2(1), 2);
}

// One call is as good as two, bit for bit.
TEST_P(Resets, AsPartOfAStep) {
  const Ids ids = Sheets(3);
  Step(*stub_, StepsOf(session_, ids, 7));
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  v1::StepRequest step = StepsOf(session_, ids, 2);
  step.set_expected_step(7);
  v1::StepResets* resets = step.mutable_resets();
  for (const uint64_t id : {ids[2], ids[0]}) {
    resets->add_cloth_ids(id);
    for (const double x : {0.1 * static_cast<double>(id % 7), 1.0, 0.0, 0.0, 0.6, 0.0, 0.8}) {
      resets->add_transforms(x);
    }
    resets->add_overrides()->set_damping_per_s(0.5);
  }
  EXPECT_THAT(Step(*stub_, step).steps(), ElementsAre(2, 9, 2));
  const Ids others = Sheets(3);
  Step(*stub_, StepsOf(session_, others, 7));
  reset.add_cloth_ids(others[2]);
  reset.add_cloth_ids(others[0]);
  *reset.mutable_transforms() = resets->transforms();
  *reset.mutable_overrides() = resets->overrides();
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  Step(*stub_, StepsOf(session_, others, 2));
  EXPECT_TRUE(Bits(*stub_, session_, ids) == Bits(*stub_, session_, others));
}

TEST_P(Resets, ARefusedStepResetsNothing) {
  const Ids ids = Sheets(2);
  Step(*stub_, StepsOf(session_, ids, 3));
  const std::string before = Bits(*stub_, session_, ids);
  v1::StepRequest step = StepsOf(session_, {ids[0]}, 1);
  step.mutable_resets()->add_cloth_ids(ids[1]);
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, step).status), ElementsAre("resets.cloth_ids[0]"));
  step = StepsOf(session_, ids, 1);
  step.mutable_resets()->add_cloth_ids(ids[0]);
  step.mutable_resets()->add_cloth_ids(ids[0]);
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, step).status), ElementsAre("resets.cloth_ids[1]"));
  step.mutable_resets()->mutable_cloth_ids()->RemoveLast();
  step.set_expected_step(4);
  EXPECT_EQ(ReasonOf(Call(*stub_, &Stub::Step, step).status), "STEP_MISMATCH");
  step.clear_expected_step();
  // Above the friction_static that the cloth has.
  step.mutable_resets()->add_overrides()->set_friction_dynamic(0.5);
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, step).status),
              ElementsAre("resets.overrides[0].friction_dynamic"));
  EXPECT_EQ(Bits(*stub_, session_, ids), before);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 3u);
}

TEST_P(Resets, AFaultedClothStartsAgainWithinAStep) {
  v1::CreateClothsRequest request = HangingSheet(session_, 4);
  request.mutable_spec()->clear_pins();
  Set(request.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, -1e11, 0});
  const Ids ids = Create(*stub_, request);
  ASSERT_THAT(Step(*stub_, StepsOf(session_, ids, 5)).faulted_cloth_ids(), ElementsAre(ids[0]));
  v1::StepRequest step = StepsOf(session_, ids, 5);
  step.mutable_resets()->add_cloth_ids(ids[0]);
  Set(step.mutable_resets()->add_overrides()->mutable_gravity_m_per_s2(), {0, -9, 0});
  const v1::StepResponse answer = Step(*stub_, step);
  EXPECT_THAT(answer.faulted_cloth_ids(), testing::IsEmpty());
  EXPECT_THAT(answer.steps(), ElementsAre(5));
}

TEST_P(Resets, UpdatesHaveAColumnForEachCloth) {
  const Ids ids = Sheets(2);
  v1::UpdateClothsRequest update;
  update.set_session(session_);
  for (const uint64_t id : ids) update.add_cloth_ids(id);
  Set(update.add_overrides()->mutable_gravity_m_per_s2(), {0, -2, 0});
  Set(update.add_overrides()->mutable_gravity_m_per_s2(), {0, -4, 0});
  update.mutable_overrides(0)->set_friction_static(0.5);
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  Step(*stub_, StepsOf(session_, ids, 60));
  EXPECT_THAT(Heights(ids),
              ElementsAre(testing::DoubleNear(-1, 1e-4), testing::DoubleNear(-2, 1e-4)));
  // All or nothing: the second one has less static friction than that.
  update.mutable_overrides(0)->set_friction_dynamic(0.25);
  update.mutable_overrides(1)->set_friction_dynamic(0.25);
  Set(update.mutable_overrides(0)->mutable_gravity_m_per_s2(), {0, 0, 0});
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::UpdateCloths, update).status),
              ElementsAre("overrides[1].friction_dynamic"));
  EXPECT_EQ(Get(*stub_, session_, ids[0]).environment().gravity_m_per_s2(1), -2);
}

}  // namespace
}  // namespace drape::test
