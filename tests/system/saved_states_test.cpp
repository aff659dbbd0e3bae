// States kept by name: going back to them, and branching from them, with the same bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"
#include "tests/system/random_traffic.h"

namespace drape::test {
namespace {

using testing::ElementsAre;

class SavedStates : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  v1::SaveStatesRequest SaveRequest(const std::string& name, const Ids& ids) const {
    v1::SaveStatesRequest request;
    request.set_session(session_);
    request.set_name(name);
    for (const uint64_t id : ids) request.add_cloth_ids(id);
    return request;
  }
  Answer<v1::SaveStatesResponse> Save(const std::string& name, const Ids& ids) {
    return Call(*stub_, &Stub::SaveStates, SaveRequest(name, ids));
  }
  grpc::Status Load(const std::string& name, const Ids& ids, const Ids& from = {}) {
    v1::LoadStatesRequest request;
    request.set_session(session_);
    request.set_name(name);
    for (const uint64_t id : ids) request.add_cloth_ids(id);
    for (const uint64_t id : from) request.add_saved_cloth_ids(id);
    return Call(*stub_, &Stub::LoadStates, request).status;
  }
  static v1::StepLoads Loads(const std::string& name, const Ids& ids, const Ids& from = {}) {
    v1::StepLoads loads;
    loads.set_name(name);
    for (const uint64_t id : ids) loads.add_cloth_ids(id);
    for (const uint64_t id : from) loads.add_saved_cloth_ids(id);
    return loads;
  }
  // What a client sees of the cloths: bits, steps, times, settings, poses of colliders.
  std::string Seen(const Ids& ids) {
    std::string seen = Bits(*stub_, session_, ids);
    for (const uint64_t id : ids) {
      v1::Cloth cloth = Get(*stub_, session_, id);
      cloth.clear_id();
      cloth.clear_environment_origin_m();
      seen += cloth.DebugString();
    }
    return seen;
  }

  void ExpectGoingOn(uint32_t seed);
  void ExpectLoadsAsPartOfAStep(uint32_t seed);

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, SavedStates, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

using SavedStatesLong = SavedStates;
INSTANTIATE_TEST_SUITE_P(Backends, SavedStatesLong, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

// Each kind of scene in the short tier, and three of each in all. gl, on llvmpipe slow and with
// other kernels for each kind, has the first kinds in the short tier: springs, bending, colliders.
constexpr uint32_t kEachKind = 8, kThreeOfEachKind = 24, kFewKinds = 3;
uint32_t ShortSeeds(const std::string& backend) {
  return backend == "gl" ? kFewKinds : kEachKind;
}
uint32_t AllSeeds(const std::string& backend) {
  return backend == "gl" ? kEachKind : kThreeOfEachKind;
}

// Save, go on, change what can be changed, load, go on: the same requests have the same answers.
void SavedStates::ExpectGoingOn(uint32_t seed) {
  RandomTraffic traffic(seed, GetParam() != "gl");
  v1::CreateClothsRequest creation = traffic.Creation(session_);
  const Ids ids = Create(*stub_, creation);
  for (uint32_t k = 0; k < 4; ++k) Step(*stub_, traffic.Steps(session_, ids));
  const std::string name = std::to_string(seed);
  const auto saved = Save(name, ids);
  ASSERT_TRUE(saved.status.ok()) << saved.status.error_message();
  EXPECT_EQ(saved.value.cloths(), ids.size());
  const std::string before = Seen(ids);

  std::vector<v1::StepRequest> requests;
  std::vector<std::string> answers;
  for (uint32_t k = 0; k < 4; ++k) {
    requests.push_back(traffic.Steps(session_, ids));
    answers.push_back(AnswerText(Step(*stub_, requests.back())));
  }
  const std::string after = Seen(ids);
  traffic.Disturb(*stub_, session_, ids);

  const grpc::Status loaded = Load(name, ids);
  ASSERT_TRUE(loaded.ok()) << loaded.error_message();
  ASSERT_TRUE(Seen(ids) == before);
  for (size_t k = 0; k < requests.size(); ++k) {
    ASSERT_EQ(AnswerText(Step(*stub_, requests[k])), answers[k]) << "request " << k;
  }
  ASSERT_TRUE(Seen(ids) == after);

  // Others, too, become what was saved, each alone: another slot, another batch.
  ASSERT_TRUE(Load(name, {ids[2]}, {ids[0]}).ok());
  ASSERT_TRUE(Load(name, {ids[0]}).ok());
  for (const v1::StepRequest& request : requests) {
    Step(*stub_, traffic.OnlyFor(request, ids[0], ids[0]));
    Step(*stub_, traffic.OnlyFor(request, ids[0], ids[2]));
  }
  EXPECT_TRUE(Seen({ids[0]}) == Seen({ids[2]}));
  v1::DeleteClothsRequest deletion;
  deletion.set_session(session_);
  for (const uint64_t id : ids) deletion.add_cloth_ids(id);
  ASSERT_TRUE(Call(*stub_, &Stub::DeleteCloths, deletion).status.ok());
}

TEST_P(SavedStates, RandomScenesGoOnWithTheSameBits) {
  for (uint32_t seed = 0; seed < ShortSeeds(GetParam()); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    ASSERT_NO_FATAL_FAILURE(ExpectGoingOn(seed));
  }
}

TEST_P(SavedStatesLong, MoreRandomScenesGoOnWithTheSameBits) {
  for (uint32_t seed = ShortSeeds(GetParam()); seed < AllSeeds(GetParam()); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    ASSERT_NO_FATAL_FAILURE(ExpectGoingOn(seed));
  }
}

// One call is as good as two, bit for bit, also where pins, colliders and model have changed since
// the cloths were saved: controls are those of what the cloths become.
void SavedStates::ExpectLoadsAsPartOfAStep(uint32_t seed) {
  RandomTraffic traffic(seed, GetParam() != "gl");
  const Ids ids = Create(*stub_, traffic.Creation(session_));
  for (uint32_t k = 0; k < 3; ++k) Step(*stub_, traffic.Steps(session_, ids));
  const std::string name = std::to_string(seed);
  ASSERT_TRUE(Save(name, ids).status.ok());
  v1::StepRequest request = traffic.Steps(session_, ids);
  traffic.Disturb(*stub_, session_, ids);
  ASSERT_TRUE(Load(name, ids).ok());
  const std::string answer = AnswerText(Step(*stub_, request));
  const std::string after = Seen(ids);

  traffic.Disturb(*stub_, session_, ids);
  *request.mutable_loads() = Loads(name, ids);
  request.set_expected_step(1'000'000);  // not asked of what is loaded
  ASSERT_EQ(AnswerText(Step(*stub_, request)), answer);
  ASSERT_TRUE(Seen(ids) == after);

  // Some of the cloths of a request, of which one becomes another.
  traffic.Disturb(*stub_, session_, ids);
  request.clear_expected_step();
  request.clear_loads();
  v1::StepRequest itself = traffic.OnlyFor(request, ids[0], ids[0]);
  *itself.mutable_loads() = Loads(name, {ids[0]});
  v1::StepRequest other = traffic.OnlyFor(request, ids[0], ids[2]);
  *other.mutable_loads() = Loads(name, {ids[2]}, {ids[0]});
  Step(*stub_, itself);
  Step(*stub_, other);
  EXPECT_TRUE(Seen({ids[0]}) == Seen({ids[2]}));
  v1::DeleteClothsRequest deletion;
  deletion.set_session(session_);
  for (const uint64_t id : ids) deletion.add_cloth_ids(id);
  ASSERT_TRUE(Call(*stub_, &Stub::DeleteCloths, deletion).status.ok());
}

TEST_P(SavedStates, LoadsAsPartOfAStep) {
  for (uint32_t seed = 0; seed < ShortSeeds(GetParam()); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    ASSERT_NO_FATAL_FAILURE(ExpectLoadsAsPartOfAStep(seed));
  }
}

TEST_P(SavedStatesLong, MoreLoadAsPartOfAStep) {
  for (uint32_t seed = ShortSeeds(GetParam()); seed < AllSeeds(GetParam()); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    ASSERT_NO_FATAL_FAILURE(ExpectLoadsAsPartOfAStep(seed));
  }
}

TEST_P(SavedStates, AStepLoadsSomeResetsSomeAndStepsTheOthers) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4, 3));
  Step(*stub_, StepsOf(session_, ids, 3));
  ASSERT_TRUE(Save("three", ids).status.ok());
  Step(*stub_, StepsOf(session_, ids, 4));
  v1::StepRequest step = StepsOf(session_, ids, 2);
  step.set_expected_step(7);
  *step.mutable_loads() = Loads("three", {ids[2]});
  step.mutable_resets()->add_cloth_ids(ids[0]);
  EXPECT_THAT(Step(*stub_, step).steps(), ElementsAre(2, 9, 5));
  step.clear_expected_step();
  step.set_until_step(9);
  EXPECT_THAT(Step(*stub_, step).steps(), ElementsAre(9, 9, 9));
  const std::string bits = Bits(*stub_, session_, {ids[1]});
  EXPECT_TRUE(Bits(*stub_, session_, {ids[0]}) == bits);
  EXPECT_TRUE(Bits(*stub_, session_, {ids[2]}) == bits);
}

TEST_P(SavedStates, AStepThatIsRefusedLoadsNothing) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4, 3));
  Step(*stub_, StepsOf(session_, ids, 3));
  ASSERT_TRUE(Save("two", {ids[0], ids[1]}).status.ok());
  const Ids others = Create(*stub_, HangingSheet(session_, 5));
  v1::UpdateClothsRequest update;
  update.set_session(session_);
  update.add_cloth_ids(ids[0]);
  update.add_cloth_ids(ids[1]);
  update.mutable_spec()->add_pins()->set_particle(5);  // the saved ones are hung by their edges
  update.mutable_update_mask()->add_paths("pins");
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  Step(*stub_, StepsOf(session_, ids, 1));
  Ids every = ids;
  every.push_back(others[0]);
  const std::string before = Seen(every);
  const auto refused = [&](const v1::StepLoads& loads, const auto& change) {
    v1::StepRequest step = StepsOf(session_, every, 1);
    *step.mutable_loads() = loads;
    change(step);
    const grpc::Status status = Call(*stub_, &Stub::Step, step).status;
    EXPECT_TRUE(Seen(every) == before) << status.error_message();
    const std::vector<std::string> fields = FieldsOf(status);
    return fields.size() == 1 ? fields[0] : ReasonOf(status);
  };
  const auto nothing_else = [](v1::StepRequest&) {};
  EXPECT_EQ(refused(Loads("none", {ids[0]}), nothing_else), "SAVED_STATES_NOT_FOUND");
  EXPECT_EQ(refused(Loads("two", {ids[0], ids[2]}), nothing_else), "loads.cloth_ids[1]");
  EXPECT_EQ(refused(Loads("two", {ids[0], ids[0]}), nothing_else), "loads.cloth_ids[1]");
  EXPECT_EQ(refused(Loads("two", {others[0]}, {ids[0]}), nothing_else), "loads.cloth_ids[0]");
  EXPECT_EQ(refused(Loads("two", {ids[0], ids[1]}, {ids[0]}), nothing_else),
            "loads.saved_cloth_ids");
  EXPECT_EQ(refused(Loads("two", {ids[0]}),
                    [&](auto& step) {
                      step.mutable_cloth_ids()->Clear();
                      step.add_cloth_ids(ids[1]);
                    }),
            "loads.cloth_ids[0]");
  EXPECT_EQ(refused(Loads("two", {ids[1], ids[0]}),
                    [&](auto& step) { step.mutable_resets()->add_cloth_ids(ids[0]); }),
            "loads.cloth_ids[1]");
  EXPECT_EQ(refused(Loads("two", {ids[0]}), [&](auto& step) { step.set_until_step(2); }),
            "STEP_MISMATCH");
  // Above the friction_static that the cloth has, which only the device thread knows.
  EXPECT_EQ(refused(Loads("two", {ids[0]}),
                    [&](auto& step) {
                      step.mutable_resets()->add_cloth_ids(ids[2]);
                      step.mutable_resets()->add_overrides()->set_friction_dynamic(0.5);
                    }),
            "resets.overrides[0].friction_dynamic");
  // A pin of now, which what is loaded does not have.
  const auto move = [&](uint32_t particle) {
    return [&, particle](v1::StepRequest& step) {
      step.mutable_pin_controls()->add_cloth_ids(ids[0]);
      step.mutable_pin_controls()->add_particles(particle);
      Set(step.mutable_pin_controls()->mutable_targets_m(), {0, 0.25, 0});
    };
  };
  EXPECT_EQ(refused(Loads("two", {ids[0]}), move(5)), "pin_controls.particles[0]");
  v1::StepRequest step = StepsOf(session_, {ids[0]}, 1);
  *step.mutable_loads() = Loads("two", {ids[0]});
  move(0)(step);
  EXPECT_THAT(Step(*stub_, step).steps(), ElementsAre(4));
}

TEST_P(SavedStates, FaultsComeBackWithinAStep) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 2);
  creation.mutable_spec()->clear_pins();
  const Ids ids = Create(*stub_, creation);
  ASSERT_TRUE(Save("good", ids).status.ok());
  v1::UpdateClothsRequest update;
  update.set_session(session_);
  update.add_cloth_ids(ids[0]);
  Set(update.add_overrides()->mutable_gravity_m_per_s2(), {0, -1e11, 0});
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  ASSERT_THAT(Step(*stub_, StepsOf(session_, ids, 5)).faulted_cloth_ids(), ElementsAre(ids[0]));
  ASSERT_TRUE(Save("fault", ids).status.ok());
  v1::StepRequest step = StepsOf(session_, ids, 5);
  *step.mutable_loads() = Loads("good", ids);
  const v1::StepResponse good = Step(*stub_, step);
  EXPECT_THAT(good.faulted_cloth_ids(), testing::IsEmpty());
  EXPECT_THAT(good.steps(), ElementsAre(5));
  step.mutable_loads()->set_name("fault");
  EXPECT_THAT(Step(*stub_, step).faulted_cloth_ids(), ElementsAre(ids[0]));
}

TEST_P(SavedStates, FaultsComeBack) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 2);
  creation.mutable_spec()->clear_pins();
  Set(creation.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, -1e11, 0});
  const Ids ids = Create(*stub_, creation);
  ASSERT_THAT(Step(*stub_, StepsOf(session_, ids, 5)).faulted_cloth_ids(), ElementsAre(ids[0]));
  const std::string before = Seen(ids);
  ASSERT_TRUE(Save("fault", ids).status.ok());
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  ASSERT_FALSE(Get(*stub_, session_, ids[0]).faulted());
  ASSERT_TRUE(Load("fault", ids).ok());
  EXPECT_TRUE(Get(*stub_, session_, ids[0]).faulted());
  EXPECT_THAT(Step(*stub_, StepsOf(session_, ids, 1)).faulted_cloth_ids(), ElementsAre(ids[0]));
  EXPECT_EQ(Seen(ids), before);
}

TEST_P(SavedStates, WhatCannotBeLoadedIsRefused) {
  const Ids sheets = Create(*stub_, HangingSheet(session_, 3, 2));
  const Ids larger = Create(*stub_, HangingSheet(session_, 4));
  v1::CreateClothsRequest elsewhere = HangingSheet(session_, 3);
  Set(elsewhere.mutable_spec()->mutable_transform()->mutable_position_m(), {1, 0, 0});
  const Ids moved = Create(*stub_, elsewhere);
  ASSERT_TRUE(Save("a", {sheets[0]}).status.ok());
  EXPECT_EQ(FieldsOf(Load("a", larger, {sheets[0]})), std::vector<std::string>{"cloth_ids[0]"});
  EXPECT_EQ(FieldsOf(Load("a", moved, {sheets[0]})), std::vector<std::string>{"cloth_ids[0]"});
  EXPECT_EQ(FieldsOf(Load("a", {sheets[1]})), std::vector<std::string>{"cloth_ids[0]"});
  EXPECT_EQ(FieldsOf(Load("a", sheets, {sheets[0]})), std::vector<std::string>{"saved_cloth_ids"});
  EXPECT_EQ(FieldsOf(Load("a", {})), std::vector<std::string>{"cloth_ids"});
  EXPECT_EQ(FieldsOf(Save("", sheets).status), std::vector<std::string>{"name"});
  EXPECT_EQ(FieldsOf(Save(std::string(129, 'x'), sheets).status), std::vector<std::string>{"name"});
  EXPECT_EQ(ReasonOf(Load("b", sheets)), "SAVED_STATES_NOT_FOUND");
  EXPECT_EQ(ReasonOf(Load("a", {7}, {sheets[0]})), "CLOTH_NOT_FOUND");
  v1::DropStatesRequest drop;
  drop.set_session(session_);
  drop.set_name("a");
  EXPECT_TRUE(Call(*stub_, &Stub::DropStates, drop).status.ok());
  EXPECT_EQ(ReasonOf(Call(*stub_, &Stub::DropStates, drop).status), "SAVED_STATES_NOT_FOUND");
  EXPECT_EQ(ReasonOf(Load("a", sheets)), "SAVED_STATES_NOT_FOUND");
}

}  // namespace
}  // namespace drape::test
