// collider_contact SURFACE through the service, on every backend.
#include <gtest/gtest.h>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

class SurfaceContactCalls : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  v1::CreateClothsRequest Sheet(v1::StepSettings::ColliderContact contact) const {
    v1::CreateClothsRequest request = HangingSheet(session_, 5, 1);
    v1::ClothSpec& spec = *request.mutable_spec();
    spec.mutable_settings()->set_collider_contact(contact);
    v1::Sphere& ball = *spec.mutable_environment()->add_colliders()->mutable_sphere();
    Set(ball.mutable_center_m(), {0, -9, 0});
    ball.set_radius_m(1);
    return request;
  }
  v1::UpdateClothsRequest Change(const Ids& ids, v1::StepSettings::ColliderContact contact) const {
    v1::UpdateClothsRequest request;
    request.set_session(session_);
    request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
    v1::StepSettings& settings = *request.mutable_spec()->mutable_settings();
    settings.set_substeps(4);  // as HangingSheet
    settings.set_collider_contact(contact);
    request.mutable_update_mask()->add_paths("settings");
    return request;
  }
  static void ExpectTaken(const grpc::Status& status) {
    EXPECT_TRUE(status.ok()) << status.error_message();
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, SurfaceContactCalls, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(SurfaceContactCalls, AreTakenWhenAClothIsMade) {
  v1::CreateClothsRequest creation = Sheet(v1::StepSettings::SURFACE);
  ExpectTaken(Call(*stub_, &Stub::CreateCloths, creation).status);
  creation.set_validate_only(true);
  ExpectTaken(Call(*stub_, &Stub::CreateCloths, creation).status);
}

// A change of its settings takes the cloth of `gl` to the cores and back, between two steps.
TEST_P(SurfaceContactCalls, AreTakenInAnUpdate) {
  const Ids ids = Create(*stub_, Sheet(v1::StepSettings::PARTICLES));
  const Ids others = Create(*stub_, Sheet(v1::StepSettings::PARTICLES));
  Step(*stub_, StepsOf(session_, {}, 2));
  for (const auto contact : {v1::StepSettings::SURFACE, v1::StepSettings::PARTICLES}) {
    ExpectTaken(Call(*stub_, &Stub::UpdateCloths, Change(ids, contact)).status);
    EXPECT_EQ(Get(*stub_, session_, ids[0]).settings().collider_contact(), contact);
    EXPECT_EQ(Bits(*stub_, session_, ids), Bits(*stub_, session_, others));
  }
  Step(*stub_, StepsOf(session_, {}, 2));
  EXPECT_EQ(Bits(*stub_, session_, ids), Bits(*stub_, session_, others));
}

}  // namespace
}  // namespace drape::test
