// The life of cloths over the wire: create, step, change, reset, delete, lists.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <thread>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

class Cloths : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    stub_ = server_.NewStub();
    session_ = NewSession(*stub_);
  }

  uint32_t ClothCount() {
    return Call(*stub_, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value.cloth_count();
  }

  v1::UpdateClothsRequest UpdateOf(const Ids& ids, const std::string& path) {
    v1::UpdateClothsRequest request;
    request.set_session(session_);
    request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
    request.mutable_update_mask()->add_paths(path);
    return request;
  }

  ServerProcess server_{{"--max-particles-per-session=1000"}};
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

std::vector<float> PositionsOf(const std::vector<v1::StateChunk>& chunks) {
  std::string data;
  for (const auto& chunk : chunks) data += chunk.positions_m().data();
  std::vector<float> positions(data.size() / sizeof(float));
  std::memcpy(positions.data(), data.data(), data.size());
  return positions;
}

TEST_F(Cloths, ValidateOnlyTellsTheShapeAndCreatesNothing) {
  v1::CreateClothsRequest request = HangingSheet(session_, 8, 3);
  request.set_validate_only(true);
  const auto answer = Call(*stub_, &Stub::CreateCloths, request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_EQ(answer.value.cloth_ids_size(), 0);
  EXPECT_EQ(answer.value.shape().particles(), 64u);
  // 2 * 8 * 7 edges, 7 of them between the pins of the first row.
  EXPECT_EQ(answer.value.shape().distance_constraints(), 105u);
  EXPECT_EQ(answer.value.shape().dropped_constraints(), 7u);
  EXPECT_EQ(answer.value.shape().pins(), 8u);
  EXPECT_NE(answer.value.shape().plan(), "");
  EXPECT_EQ(ClothCount(), 0u);
  request.mutable_spec()->mutable_grid()->set_rows(0);
  EXPECT_FALSE(Call(*stub_, &Stub::CreateCloths, request).status.ok());
}

// Two links of 1 m, described 2 m and 1 m long: the second particle comes to the pin, the third
// after it.
TEST_F(Cloths, StartsAtItsLengths) {
  v1::CreateClothsRequest request;
  request.set_session(session_);
  auto& particles = *request.mutable_spec()->mutable_particles();
  for (const double p : {0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0}) particles.add_positions_m(p);
  for (uint32_t k = 0; k < 3; ++k) particles.add_masses_kg(0.1);
  for (uint32_t k = 0; k < 2; ++k) {
    auto& link = *particles.add_distance_constraints();
    link.set_i(k);
    link.set_j(k + 1);
    link.set_rest_length_m(1);
  }
  request.mutable_spec()->add_pins()->set_particle(0);
  const auto answer = Call(*stub_, &Stub::CreateCloths, request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_DOUBLE_EQ(answer.value.shape().start_correction().described_error(), 1);
  EXPECT_LE(answer.value.shape().start_correction().start_error(), 1e-6);
  const auto positions = PositionsOf(Read(*stub_, session_, {answer.value.cloth_ids(0)}));
  ASSERT_EQ(positions.size(), 9u);
  EXPECT_NEAR(positions[3], 1, 2e-6);
  EXPECT_NEAR(positions[6], 2, 4e-6);
  particles.mutable_distance_constraints(0)->clear_rest_length_m();  // 2 m, as described
  const auto kept = Call(*stub_, &Stub::CreateCloths, request);
  ASSERT_TRUE(kept.status.ok()) << kept.status.error_message();
  EXPECT_FALSE(kept.value.shape().has_start_correction());
}

// A sheet through the middle of a sphere starts outside, and is reset there; one with a pin in
// there cannot.
TEST_F(Cloths, StartsBesideItsColliders) {
  v1::CreateClothsRequest request = HangingSheet(session_, 12);
  request.mutable_spec()->clear_pins();
  const double middle_m = 5.0 / 11;
  v1::Sphere* sphere =
      request.mutable_spec()->mutable_environment()->add_colliders()->mutable_sphere();
  Set(sphere->mutable_center_m(), {middle_m, 0, middle_m});
  sphere->set_radius_m(0.3);
  const auto answer = Call(*stub_, &Stub::CreateCloths, request);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  const v1::StartCorrection& correction = answer.value.shape().start_correction();
  EXPECT_TRUE(answer.value.shape().has_start_correction());
  EXPECT_LE(correction.start_error(), 1e-6);
  const Ids ids = {answer.value.cloth_ids(0)};
  EXPECT_TRUE(Get(*stub_, session_, ids[0]).shape().has_start_correction());
  const auto positions = PositionsOf(Read(*stub_, session_, ids));
  for (size_t k = 0; k < positions.size(); k += 3) {
    const double x = positions[k] - middle_m, y = positions[k + 1], z = positions[k + 2] - middle_m;
    EXPECT_GE(std::sqrt(x * x + y * y + z * z), 0.3 - 1e-6) << k / 3;
  }
  const std::string start = Bits(*stub_, session_, ids);
  Step(*stub_, StepsOf(session_, ids, 3));
  EXPECT_NE(Bits(*stub_, session_, ids), start);
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_EQ(Bits(*stub_, session_, ids), start);

  request.mutable_spec()->add_pins()->set_particle(5 * 12 + 5);
  request.set_validate_only(true);
  const auto held = Call(*stub_, &Stub::CreateCloths, request);
  ASSERT_TRUE(held.status.ok()) << held.status.error_message();
  EXPECT_FALSE(held.value.shape().has_start_correction());
}

// A sheet that hangs by two corners under ten thousand times its weight gets all the substeps that
// load may add, under its own weight none.
TEST_F(Cloths, SubstepsFollowTheLoad) {
  v1::CreateClothsRequest request = HangingSheet(session_, 8, 1);
  request.mutable_spec()->clear_settings();
  request.mutable_spec()->clear_pins();
  for (const uint32_t pin : {0u, 7u}) request.mutable_spec()->add_pins()->set_particle(pin);
  const auto set_gravity = [](v1::ClothSpec& spec, double gravity) {
    spec.mutable_environment()->clear_gravity_m_per_s2();
    for (const double g : {0.0, -gravity, 0.0}) {
      spec.mutable_environment()->add_gravity_m_per_s2(g);
    }
  };
  set_gravity(*request.mutable_spec(), 98100);
  const Ids ids = Create(*stub_, request);
  const auto substeps_of = [&](uint64_t id) {
    return Get(*stub_, session_, id).settings().substeps();
  };
  EXPECT_EQ(substeps_of(ids.at(0)), 94u);
  Step(*stub_, StepsOf(session_, ids, 1));
  v1::UpdateClothsRequest lighter = UpdateOf(ids, "environment.gravity_m_per_s2");
  set_gravity(*lighter.mutable_spec(), 9.81);
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, lighter).status.ok());
  EXPECT_EQ(substeps_of(ids.at(0)), 52u);
  request.mutable_spec()->mutable_settings()->set_substeps(20);
  EXPECT_EQ(substeps_of(Create(*stub_, request).at(0)), 20u) << "as asked for";
}

TEST_F(Cloths, CreationIsAtomic) {
  // 15 sheets of 64 particles fit under the quota of 1000, 16 do not.
  const auto refused = Call(*stub_, &Stub::CreateCloths, HangingSheet(session_, 8, 16));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(refused.status), "QUOTA_EXCEEDED");
  EXPECT_THAT(refused.status.error_message(), testing::HasSubstr("1000"));
  EXPECT_EQ(ClothCount(), 0u);
  EXPECT_EQ(Create(*stub_, HangingSheet(session_, 8, 15)).size(), 15u);
}

TEST_F(Cloths, CopiesLieInTheirOwnEnvironmentsAndDifferOnlyByTheShift) {
  v1::CreateClothsRequest request = HangingSheet(session_, 4, 2);
  Set(request.mutable_environment_origins_m(), {0, 0, 0, 8, 0, 0});
  Set(request.mutable_spec()->mutable_transform()->mutable_position_m(), {0, 2, 0});
  const Ids ids = Create(*stub_, request);
  Step(*stub_, StepsOf(session_, ids, 10));
  const auto first = PositionsOf(Read(*stub_, session_, {ids[0]}));
  const auto second = PositionsOf(Read(*stub_, session_, {ids[1]}));
  ASSERT_EQ(first.size(), 48u);
  // One rounding to float of coordinates below 16 m in each of the two.
  const float round_off = 2 * std::ldexp(1.f, 3 - 24);
  for (size_t k = 0; k < first.size(); ++k) {
    EXPECT_NEAR(second[k] - first[k], k % 3 == 0 ? 8 : 0, round_off);
  }
  // The pinned corner is where the transform puts it.
  EXPECT_EQ(first[1], 2);
}

TEST_F(Cloths, ARepeatedCreationHappensOnce) {
  v1::CreateClothsRequest request = HangingSheet(session_);
  request.set_request_id("create-1");
  const Ids ids = Create(*stub_, request);
  EXPECT_EQ(Create(*stub_, request), ids);
  EXPECT_EQ(ClothCount(), 1u);
  request.set_count(2);
  const auto different = Call(*stub_, &Stub::CreateCloths, request);
  EXPECT_EQ(different.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(FieldsOf(different.status), testing::ElementsAre("request_id"));
}

TEST_F(Cloths, ARepeatedStepHappensOnceAndAnswersTheSame) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  v1::StepRequest request = StepsOf(session_, ids, 3);
  request.set_request_id("step-1");
  request.mutable_view();
  const v1::StepResponse first = Step(*stub_, request);
  EXPECT_EQ(Step(*stub_, request).SerializeAsString(), first.SerializeAsString());
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 3u);
  // A failed request is not remembered: its id may be used again.
  v1::StepRequest failing = StepsOf(session_, ids, 1);
  failing.set_request_id("step-2");
  failing.set_expected_step(7);
  EXPECT_EQ(ReasonOf(Call(*stub_, &Stub::Step, failing).status), "STEP_MISMATCH");
  failing.set_expected_step(3);
  EXPECT_EQ(Step(*stub_, failing).steps(0), 4u);
}

TEST_F(Cloths, ExpectedAndUntilStepGuardTheOrder) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  v1::StepRequest request = StepsOf(session_, ids, 0);
  request.set_until_step(5);
  EXPECT_EQ(Step(*stub_, request).steps(0), 5u);
  EXPECT_EQ(Step(*stub_, request).steps(0), 5u) << "already there: no step";
  request.set_until_step(4);
  EXPECT_EQ(ReasonOf(Call(*stub_, &Stub::Step, request).status), "STEP_MISMATCH");
  // 5 * (1/60) as one product.
  EXPECT_EQ(Get(*stub_, session_, ids[0]).time_s(), 5 * (1.0 / 60));
}

// A selection that happens to be empty must not act on everything.
TEST_F(Cloths, NoClothsAreNotAllCloths) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4, 2));
  Step(*stub_, StepsOf(session_, ids, 1));
  v1::StepRequest step;
  step.set_session(session_);
  step.set_steps(1);
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  v1::RenderRequest picture;
  picture.set_session(session_);
  const grpc::Status refused[] = {Call(*stub_, &Stub::Step, step).status,
                                  Call(*stub_, &Stub::ResetCloths, reset).status,
                                  Call(*stub_, &Stub::Render, picture).status};
  for (const grpc::Status& status : refused) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(FieldsOf(status), testing::ElementsAre("cloth_ids"));
    EXPECT_THAT(status.error_message(), testing::HasSubstr("all_cloths"));
  }
  step.set_all_cloths(true);
  step.add_cloth_ids(ids[0]);
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, step).status), testing::ElementsAre("all_cloths"));
  for (const uint64_t id : ids) EXPECT_EQ(Get(*stub_, session_, id).step(), 1u);
  step.clear_cloth_ids();
  EXPECT_THAT(Step(*stub_, step).steps(), testing::ElementsAre(2, 2));
}

TEST_F(Cloths, AStepAnswersReportsAndStates) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4, 2));
  v1::StepRequest request = StepsOf(session_, {}, 2);
  request.set_report(true);
  request.mutable_view()->set_velocities(true);
  const v1::StepResponse response = Step(*stub_, request);
  EXPECT_THAT(response.cloth_ids(), testing::ElementsAreArray(ids));
  EXPECT_THAT(response.steps(), testing::ElementsAre(2, 2));
  ASSERT_EQ(response.reports_size(), 2);
  EXPECT_EQ(response.reports(1).cloth_id(), ids[1]);
  EXPECT_GT(response.reports(1).kinetic_energy_j(), 0);
  EXPECT_LT(response.reports(1).lowest_m(), 0);
  EXPECT_EQ(response.reports(1).iterations(), 4u);
  EXPECT_FALSE(response.states().has_positions_m());
  EXPECT_EQ(response.states().velocities_m_per_s().data().size(), 2 * 16 * 3 * sizeof(float));
  EXPECT_GT(response.timing().encode_us(), 0u);
  EXPECT_GT(response.timing().device_us() + response.timing().queue_us(), 0u);
}

TEST_F(Cloths, StatesThatAreTooLargeForAStepAnswerAreRefusedBeforeTheStep) {
  ServerProcess server({"--max-step-state-bytes=1000"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 10));
  v1::StepRequest request = StepsOf(session, ids, 1);
  request.mutable_view();
  const auto refused = Call(*stub, &Stub::Step, request);
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(FieldsOf(refused.status), testing::ElementsAre("view"));
  EXPECT_THAT(refused.status.error_message(), testing::HasSubstr("use StepInChunks"));
  EXPECT_EQ(Get(*stub, session, ids[0]).step(), 0u);
}

TEST_F(Cloths, GravityChangesWhileTheClothRuns) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 2));
  std::thread runner([&] { Step(*stub_, StepsOf(session_, ids, 20000)); });
  while (Get(*stub_, session_, ids[0]).step() == 0) std::this_thread::yield();
  v1::UpdateClothsRequest update = UpdateOf(ids, "environment.gravity_m_per_s2");
  Set(update.mutable_spec()->mutable_environment()->mutable_gravity_m_per_s2(), {0, 9, 0});
  const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  const v1::Cloth during = Get(*stub_, session_, ids[0]);
  EXPECT_THAT(during.environment().gravity_m_per_s2(), testing::ElementsAre(0, 9, 0));
  EXPECT_LT(during.step(), 20000u) << "the update came too late to be one while running";
  runner.join();
  // It hangs upwards now, as far as its links are long: row 1 is above row 0.
  update.mutable_update_mask()->set_paths(0, "material.damping_per_s");
  update.mutable_spec()->mutable_material()->set_damping_per_s(5);
  EXPECT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  Step(*stub_, StepsOf(session_, ids, 600));
  EXPECT_GT(PositionsOf(Read(*stub_, session_, ids))[7], 0.9f);
}

// Its top is at 0.75 m in the environment, whose origin is at 100 m in the world.
TEST_F(Cloths, ABoxPutUnderARunningClothCatchesIt) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 4);
  creation.mutable_spec()->clear_pins();
  Set(creation.mutable_spec()->mutable_transform()->mutable_position_m(), {5, 1, 0});
  Set(creation.mutable_environment_origins_m(), {0, 100, 0});
  const Ids ids = Create(*stub_, creation);
  Step(*stub_, StepsOf(session_, ids, 2));
  v1::UpdateClothsRequest update = UpdateOf(ids, "environment.colliders");
  v1::Box* box = update.mutable_spec()->mutable_environment()->add_colliders()->mutable_box();
  Set(box->mutable_center_m(), {5.5, 0.25, 0.5});
  Set(box->mutable_half_extents_m(), {1, 0.5, 0.75});
  Set(box->mutable_rotation_xyzw(), {0, 1, 0, 2});
  ASSERT_TRUE(Call(*stub_, &Stub::UpdateCloths, update).status.ok());
  Step(*stub_, StepsOf(session_, ids, 120));
  const auto positions = PositionsOf(Read(*stub_, session_, ids));
  for (size_t i = 0; i < 16; ++i) {
    // Rounding of a float near 100, and of the gap near 1.
    EXPECT_NEAR(positions[3 * i + 1], 100.75, 100.75 * 0x1p-24 + 8 * 0x1p-24) << "particle " << i;
  }
  EXPECT_THAT(Get(*stub_, session_, ids[0]).environment().colliders(0).box().center_m(),
              testing::ElementsAre(5.5, 0.25, 0.5));
}

TEST_F(Cloths, NewPinsKeepTheState) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4));
  Step(*stub_, StepsOf(session_, ids, 10));
  const auto before = PositionsOf(Read(*stub_, session_, ids));
  v1::UpdateClothsRequest update = UpdateOf(ids, "pins");
  update.mutable_spec()->add_pins()->set_particle(15);
  const auto answer = Call(*stub_, &Stub::UpdateCloths, update);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_EQ(answer.value.shape().pins(), 1u);
  EXPECT_EQ(answer.value.shape().distance_constraints(), 24u) << "none between two pins any more";
  EXPECT_EQ(PositionsOf(Read(*stub_, session_, ids)), before);
  Step(*stub_, StepsOf(session_, ids, 10));
  const auto after = PositionsOf(Read(*stub_, session_, ids));
  EXPECT_EQ(after[45], before[45]);
  EXPECT_EQ(after[46], before[46]);
  EXPECT_LT(after[1], before[1]) << "the old pin is free and falls";
}

TEST_F(Cloths, PinControlsMoveAPin) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4));
  v1::StepRequest request = StepsOf(session_, ids, 30);
  v1::PinControls* controls = request.mutable_pin_controls();
  controls->add_cloth_ids(ids[0]);
  controls->add_particles(0);
  Set(controls->mutable_targets_m(), {0, 0.25, 0.5});
  controls->add_over_s(0.25);
  Step(*stub_, request);
  const auto positions = PositionsOf(Read(*stub_, session_, ids));
  EXPECT_EQ(positions[1], 0.25f);
  EXPECT_EQ(positions[2], 0.5f);
}

TEST_F(Cloths, ResetGoesBackToTheSameBits) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  const std::string start = Bits(*stub_, session_, ids);
  Step(*stub_, StepsOf(session_, ids, 5));
  const std::string after = Bits(*stub_, session_, ids);
  EXPECT_NE(after, start);
  v1::ResetClothsRequest request;
  request.set_session(session_);
  request.set_all_cloths(true);
  EXPECT_TRUE(Call(*stub_, &Stub::ResetCloths, request).status.ok());
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 0u);
  EXPECT_EQ(Bits(*stub_, session_, ids), start);
  Step(*stub_, StepsOf(session_, ids, 5));
  EXPECT_EQ(Bits(*stub_, session_, ids), after);
}

TEST_F(Cloths, DeletedIdsAreGoneAndTheirQuotaIsBack) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 15));
  v1::DeleteClothsRequest request;
  request.set_session(session_);
  request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
  EXPECT_TRUE(Call(*stub_, &Stub::DeleteCloths, request).status.ok());
  const Ids again = Create(*stub_, HangingSheet(session_, 8, 15));
  EXPECT_THAT(again, testing::Each(testing::Not(testing::AnyOfArray(ids))));
  EXPECT_EQ(ReasonOf(Call(*stub_, &Stub::Step, StepsOf(session_, {ids[0]}, 1)).status),
            "CLOTH_NOT_FOUND");
}

TEST_F(Cloths, ListsComeInPages) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 2, 7));
  v1::ListClothsRequest request;
  request.set_session(session_);
  request.set_page_size(3);
  Ids listed;
  do {
    const auto page = Call(*stub_, &Stub::ListCloths, request);
    ASSERT_TRUE(page.status.ok()) << page.status.error_message();
    EXPECT_LE(page.value.cloths_size(), 3);
    for (const v1::Cloth& cloth : page.value.cloths()) listed.push_back(cloth.id());
    request.set_page_token(page.value.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, ids);
}

TEST_F(Cloths, APageOfLargeClothsEndsBeforeItGrowsTooLong) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 2, 200);  // 10 kB each
  for (int k = 0; k < 250; ++k) {
    v1::Sphere* sphere =
        creation.mutable_spec()->mutable_environment()->add_colliders()->mutable_sphere();
    Set(sphere->mutable_center_m(), {0, -10.5, k + 0.5});
    sphere->set_radius_m(0.25);
  }
  const Ids ids = Create(*stub_, creation);
  v1::ListClothsRequest request;
  request.set_session(session_);
  request.set_page_size(1000);
  Ids listed;
  int pages = 0;
  do {
    const auto page = Call(*stub_, &Stub::ListCloths, request);
    ASSERT_TRUE(page.status.ok()) << page.status.error_message();
    EXPECT_GT(page.value.cloths_size(), 0);
    EXPECT_LT(page.value.ByteSizeLong(), (1u << 20) + 4096);
    for (const v1::Cloth& cloth : page.value.cloths()) listed.push_back(cloth.id());
    request.set_page_token(page.value.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, ids);
  EXPECT_GT(pages, 1) << "the cloths fit into one page: nothing was tested";
}

TEST_F(Cloths, AStepThatWouldTakeHoursIsRefused) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 30);
  creation.mutable_spec()->mutable_settings()->set_substeps(10000);
  creation.mutable_spec()->mutable_settings()->set_max_iterations(10000);
  const auto refused = Call(*stub_, &Stub::CreateCloths, creation);
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(FieldsOf(refused.status), testing::ElementsAre("spec.settings"));
  EXPECT_EQ(ClothCount(), 0u);
  const Ids ids = Create(*stub_, HangingSheet(session_, 30));
  v1::UpdateClothsRequest update = UpdateOf(ids, "settings");
  *update.mutable_spec() = creation.spec();
  const auto kept = Call(*stub_, &Stub::UpdateCloths, update);
  EXPECT_THAT(FieldsOf(kept.status), testing::ElementsAre("spec.settings"));
  EXPECT_EQ(Get(*stub_, session_, ids[0]).settings().substeps(), 4u);
}

TEST_F(Cloths, ARequestIdOfAnotherMethodIsRefused) {
  v1::CreateClothsRequest creation = HangingSheet(session_);
  creation.set_request_id("once");
  v1::StepRequest step = StepsOf(session_, Create(*stub_, creation), 1);
  step.set_request_id("once");
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, step).status), testing::ElementsAre("request_id"));
}

TEST_F(Cloths, AStepWithARequestIdIsCompletedThoughItsClientHasGone) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  v1::StepRequest request = StepsOf(session_, ids, 20000);
  request.set_request_id("step-1");
  {
    grpc::ClientContext context;
    std::thread canceller([&] {
      while (Get(*stub_, session_, ids[0]).step() == 0) std::this_thread::yield();
      context.TryCancel();
    });
    v1::StepResponse response;
    EXPECT_EQ(stub_->Step(&context, request, &response).error_code(), grpc::StatusCode::CANCELLED);
    canceller.join();
  }
  auto repeated = Call(*stub_, &Stub::Step, request);
  while (ReasonOf(repeated.status) == "REQUEST_IN_PROGRESS") {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    repeated = Call(*stub_, &Stub::Step, request);
  }
  ASSERT_TRUE(repeated.status.ok()) << repeated.status.error_message();
  EXPECT_EQ(repeated.value.steps(0), 20000u);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 20000u);
}

}  // namespace
}  // namespace drape::test
