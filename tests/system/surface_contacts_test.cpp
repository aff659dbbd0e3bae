// collider_contact SURFACE through the service: taken where the backend has it, refused elsewhere.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class SurfaceContactCalls : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { session_ = NewSession(*stub_); }

  v1::CreateClothsRequest Sheet(v1::StepSettings::ColliderContact contact) const {
    v1::CreateClothsRequest request = HangingSheet(session_, 5, 1);
    request.mutable_spec()->mutable_settings()->set_collider_contact(contact);
    return request;
  }
  v1::UpdateClothsRequest Change(const Ids& ids) const {
    v1::UpdateClothsRequest request;
    request.set_session(session_);
    request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
    request.mutable_spec()->mutable_settings()->set_collider_contact(v1::StepSettings::SURFACE);
    request.mutable_update_mask()->add_paths("settings");
    return request;
  }
  bool has_surface_contacts() const {
    return SharedBackend(GetParam()).Describe().has_surface_contacts;
  }
  void ExpectTaken(const grpc::Status& status) const {
    if (has_surface_contacts()) {
      EXPECT_TRUE(status.ok()) << status.error_message();
      return;
    }
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(FieldsOf(status), ElementsAre("spec.settings.collider_contact"));
    EXPECT_THAT(status.error_message(), HasSubstr("backend " + GetParam()));
  }

  InProcessServer server_{GetParam()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
};
INSTANTIATE_TEST_SUITE_P(Backends, SurfaceContactCalls, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(SurfaceContactCalls, AreTakenOrRefusedByName) {
  v1::CreateClothsRequest creation = Sheet(v1::StepSettings::SURFACE);
  ExpectTaken(Call(*stub_, &Stub::CreateCloths, creation).status);
  creation.set_validate_only(true);
  ExpectTaken(Call(*stub_, &Stub::CreateCloths, creation).status);
}

TEST_P(SurfaceContactCalls, AreTakenOrRefusedInAnUpdate) {
  const Ids ids = Create(*stub_, Sheet(v1::StepSettings::PARTICLES));
  ExpectTaken(Call(*stub_, &Stub::UpdateCloths, Change(ids)).status);
  const auto expected =
      has_surface_contacts() ? v1::StepSettings::SURFACE : v1::StepSettings::PARTICLES;
  EXPECT_EQ(Get(*stub_, session_, ids[0]).settings().collider_contact(), expected);
}

}  // namespace
}  // namespace drape::test
