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

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, SavedStates, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

// Save, go on, change what can be changed, load, go on: the same requests have the same answers.
TEST_P(SavedStates, RandomScenesGoOnWithTheSameBits) {
  // Each kind once on gl, where nearly all of the time is compiling kernels.
  const uint32_t seeds = GetParam() == "gl" ? 8 : 24;
  for (uint32_t seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
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
