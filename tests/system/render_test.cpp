// Pictures over gRPC, of every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "tests/api/requests.h"
#include "tests/support/backends/backends.h"
#include "tests/support/png/png_image.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Render : public testing::TestWithParam<std::string> {
 protected:
  explicit Render(std::vector<std::string> flags = {})
      : server_([&] {
          flags.push_back("--backend=" + GetParam());
          return flags;
        }()) {}

  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    stub_ = server_.NewStub();
    session_ = NewSession(*stub_);
  }

  // Small: llvmpipe draws it in milliseconds.
  v1::RenderRequest Picture(const Ids& ids) const {
    v1::RenderRequest request;
    request.set_session(session_);
    request.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
    request.set_all_cloths(ids.empty());
    request.set_width_px(160);
    request.set_height_px(120);
    return request;
  }
  v1::RenderResponse Draw(const v1::RenderRequest& request) {
    const auto answer = Call(*stub_, &Stub::Render, request);
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    return answer.value;
  }
  grpc::Status Refusal(const v1::RenderRequest& request) {
    return Call(*stub_, &Stub::Render, request).status;
  }

  ServerProcess server_;
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

// Only what the last step told can be shown.
TEST_P(Render, ContactsAreThoseOfTheLastStep) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 5, 1);
  creation.mutable_spec()->clear_pins();
  v1::Plane& floor =
      *creation.mutable_spec()->mutable_environment()->add_colliders()->mutable_plane();
  for (const double x : {0.0, 0.0, 0.0}) floor.add_point_m(x);
  for (const double x : {0.0, 1.0, 0.0}) floor.add_normal(x);
  const Ids ids = Create(*stub_, creation);
  v1::RenderRequest picture = Picture(ids);
  picture.set_colouring(v1::RenderRequest::CONTACT);
  v1::StepRequest step = StepsOf(session_, ids, 2);
  Step(*stub_, step);
  EXPECT_EQ(ReasonOf(Refusal(picture)), "NO_CONTACTS");
  step.set_contact_impulses(true);
  const v1::ContactImpulses contacts = Step(*stub_, step).contact_impulses();
  double largest_n_s = 0;
  for (int row = 0; row < contacts.particles_size(); ++row) {
    largest_n_s = std::max(
        largest_n_s, std::hypot(contacts.impulses_n_s(3 * row), contacts.impulses_n_s(3 * row + 1),
                                contacts.impulses_n_s(3 * row + 2)));
  }
  ASSERT_GT(largest_n_s, 0);
  const v1::RenderResponse drawn = Draw(picture);
  EXPECT_THAT(drawn.range(),
              ElementsAre(0, testing::DoubleNear(60 * largest_n_s, 1e-5 * 60 * largest_n_s)));
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.mutable_cloth_ids()->Assign(ids.begin(), ids.end());
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  EXPECT_EQ(ReasonOf(Refusal(picture)), "NO_CONTACTS") << "they were of another state";
}

TEST_P(Render, AClothIsSeenFromTheCameraThatWasFitted) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Step(*stub_, StepsOf(session_, ids, 3));
  const v1::RenderResponse drawn = Draw(Picture(ids));
  const PngImage image = DecodePng(drawn.png());
  EXPECT_EQ(image.width_px, 160u);
  EXPECT_EQ(image.height_px, 120u);
  EXPECT_THAT(drawn.cloth_ids(), ElementsAre(ids[0]));
  EXPECT_THAT(drawn.steps(), ElementsAre(3));
  EXPECT_FALSE(drawn.device().empty());
  EXPECT_EQ(drawn.range_size(), 0);
  ASSERT_EQ(drawn.bounds_m_size(), 6);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LE(drawn.bounds_m(axis), drawn.bounds_m(3 + axis));

  // The same camera, turned round, sees the background alone.
  v1::RenderRequest away = Picture(ids);
  *away.mutable_camera() = drawn.camera();
  for (int axis = 0; axis < 3; ++axis) {
    away.mutable_camera()->set_target_m(
        axis, 2 * drawn.camera().eye_m(axis) - drawn.camera().target_m(axis));
  }
  const double share = DifferentShare(image, DecodePng(Draw(away).png()));
  EXPECT_GT(share, 0.1) << "the cloth fills a good part of a picture fitted to it";
  EXPECT_LT(share, 0.9);

  // And not turned round the same as before.
  *away.mutable_camera() = drawn.camera();
  EXPECT_LT(DifferentShare(image, DecodePng(Draw(away).png())), 0.01);
}

TEST_P(Render, ColoursComeWithTheirRange) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Step(*stub_, StepsOf(session_, ids, 10));
  v1::RenderRequest request = Picture(ids);
  const PngImage plain = DecodePng(Draw(request).png());
  for (const auto colouring : {v1::RenderRequest::STRAIN, v1::RenderRequest::SPEED}) {
    request.set_colouring(colouring);
    const v1::RenderResponse drawn = Draw(request);
    ASSERT_EQ(drawn.range_size(), 2);
    EXPECT_LT(drawn.range(0), drawn.range(1));
    if (colouring == v1::RenderRequest::STRAIN) {
      EXPECT_EQ(drawn.range(0), -drawn.range(1)) << "symmetric about 0";
    }
    EXPECT_GT(DifferentShare(plain, DecodePng(drawn.png())), 0.01);
  }
  Set(request.mutable_range(), {0, 0.5});
  EXPECT_THAT(Draw(request).range(), ElementsAre(0, 0.5));
  request.clear_range();
  request.set_colouring(v1::RenderRequest::COLOUR_GROUP);
  EXPECT_EQ(Draw(request).range_size(), 0);
}

// But for the rounding of places: a sample at an edge may change sides (RenderRequest.tiles).
void ExpectNearlyEqual(const std::string& alone, const std::string& tile) {
  ASSERT_EQ(alone.size(), tile.size());
  size_t other = 0;
  for (size_t k = 0; k < tile.size(); ++k) {
    other += std::abs(static_cast<uint8_t>(alone[k]) - static_cast<uint8_t>(tile[k])) > 2;
  }
  EXPECT_LE(other, tile.size() / 500);
}

// Cloths of two models, whose states are in one array on the device or on the host.
TEST_P(Render, TilesArePicturesOfEachClothAlone) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 8, 2);
  Set(creation.mutable_environment_origins_m(), {0, 0, 0, 32, 0, -8});
  Ids ids = Create(*stub_, creation);
  ids.push_back(Create(*stub_, HangingSheet(session_, 5))[0]);
  Step(*stub_, StepsOf(session_, ids, 5));
  v1::RenderRequest request = Picture(ids);
  request.set_colouring(v1::RenderRequest::SPEED);
  Set(request.mutable_range(), {0, 1});
  request.set_encoding(v1::RenderRequest::RGB8);
  request.set_tiles(true);
  Set(request.mutable_camera()->mutable_eye_m(), {0.5, 1, 2.5});
  Set(request.mutable_camera()->mutable_target_m(), {0.5, -0.25, 0.5});
  const v1::RenderResponse tiles = Draw(request);
  const size_t tile_bytes = 3 * 160 * 120;
  ASSERT_EQ(tiles.rgb().size(), 3 * tile_bytes);
  EXPECT_TRUE(tiles.png().empty());
  request.set_tiles(false);
  for (int k = 0; k < 3; ++k) {
    v1::RenderRequest alone = request;
    alone.clear_cloth_ids();
    alone.add_cloth_ids(ids[k]);
    if (k == 1) Set(alone.mutable_camera()->mutable_eye_m(), {32.5, 1, -5.5});
    if (k == 1) Set(alone.mutable_camera()->mutable_target_m(), {32.5, -0.25, -7.5});
    ExpectNearlyEqual(Draw(alone).rgb(), tiles.rgb().substr(k * tile_bytes, tile_bytes));
  }
  EXPECT_NE(tiles.rgb().substr(0, tile_bytes), tiles.rgb().substr(2 * tile_bytes, tile_bytes));
  // The pixels are those of the file.
  v1::RenderRequest file = request;
  file.clear_encoding();
  EXPECT_TRUE(DecodePng(Draw(file).png()).rgb == [&] {
    const std::string rgb = Draw(request).rgb();
    return std::vector<uint8_t>(rgb.begin(), rgb.end());
  }());
  request.set_tiles(true);
  request.set_depths(true);
  EXPECT_EQ(Draw(request).depths_m().size(), 3 * 160 * 120 * sizeof(float));
  request.clear_camera();
  EXPECT_THAT(Refusal(request).error_message(), HasSubstr("camera"));
}

TEST_P(Render, NoIdsMeansEveryClothAndABoxWidensTheView) {
  v1::CreateClothsRequest creation = HangingSheet(session_, 8, 2);
  Set(creation.mutable_environment_origins_m(), {0, 0, 0, 3, 0, 0});
  const Ids ids = Create(*stub_, creation);
  const v1::RenderResponse both = Draw(Picture({}));
  EXPECT_THAT(both.cloth_ids(), ElementsAre(ids[0], ids[1]));
  const v1::RenderResponse one = Draw(Picture({ids[1]}));
  EXPECT_GT(one.bounds_m(0), 2) << "in the world";
  v1::RenderRequest wide = Picture({ids[1]});
  *wide.mutable_fit()->mutable_include_m() = both.bounds_m();
  const v1::RenderResponse widened = Draw(wide);
  EXPECT_THAT(widened.bounds_m(), testing::Pointwise(testing::DoubleNear(1e-6), both.bounds_m()));
}

// Pictures read states between two rounds and change nothing: neither while others draw, nor by
// drawing oneself.
TEST_P(Render, SteppingWhilePicturesAreTakenGivesTheSameBits) {
  const Ids quiet = Create(*stub_, HangingSheet(session_));
  Step(*stub_, StepsOf(session_, quiet, 60));
  const std::string expected = Bits(*stub_, session_, quiet);

  const Ids drawn = Create(*stub_, HangingSheet(session_));
  std::atomic<bool> is_over = false;
  std::thread painter([&] {
    const auto stub = server_.NewStub();
    while (!is_over) {
      const auto answer = Call(*stub, &Stub::Render, Picture(drawn));
      EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    }
  });
  for (int k = 0; k < 60; ++k) {
    Step(*stub_, StepsOf(session_, drawn, 1));
    if (k % 20 == 0) Draw(Picture(drawn));
  }
  is_over = true;
  painter.join();
  EXPECT_EQ(Bits(*stub_, session_, drawn), expected);
}

TEST_P(Render, WhatIsNotThereIsNotFound) {
  EXPECT_EQ(ReasonOf(Refusal(Picture({}))), "NO_CLOTHS");
  const Ids ids = Create(*stub_, HangingSheet(session_));
  const std::string other = NewSession(*stub_);
  const Ids others = Create(*stub_, HangingSheet(other));
  EXPECT_EQ(ReasonOf(Refusal(Picture(others))), "CLOTH_NOT_FOUND");
  v1::DeleteClothsRequest deletion;
  deletion.set_session(session_);
  deletion.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub_, &Stub::DeleteCloths, deletion).status.ok());
  const grpc::Status stale = Refusal(Picture(ids));
  EXPECT_EQ(stale.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(ReasonOf(stale), "CLOTH_NOT_FOUND");
  v1::RenderRequest unknown = Picture({});
  unknown.set_session("sessions/none");
  EXPECT_EQ(ReasonOf(Refusal(unknown)), "SESSION_NOT_FOUND");
  unknown.set_width_px(5);
  EXPECT_THAT(FieldsOf(Refusal(unknown)), ElementsAre("width_px"));
}

INSTANTIATE_TEST_SUITE_P(Backends, Render, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

class RenderLimitsTest : public Render {
 protected:
  RenderLimitsTest()
      : Render({"--max-particles-per-picture=100", "--max-pictures-in-flight-per-session=1"}) {}
};

TEST_P(RenderLimitsTest, AreHeldAndPublished) {
  const auto info = Call(*stub_, &Stub::GetServerInfo, v1::GetServerInfoRequest());
  EXPECT_EQ(info.value.limits().max_picture_edge_px(), 4096u);
  EXPECT_EQ(info.value.limits().max_particles_per_picture(), 100u);
  EXPECT_EQ(info.value.limits().max_colliders_per_picture(), 65536u);
  EXPECT_EQ(info.value.limits().max_pictures_in_flight_per_session(), 1u);
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 2));
  Draw(Picture({ids[0]}));
  const grpc::Status large = Refusal(Picture(ids));
  EXPECT_EQ(large.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(large), "PICTURE_TOO_LARGE");
  EXPECT_THAT(large.error_message(), HasSubstr("max_particles_per_picture is 100: 128 wanted"));
}

// Ten at once and one place: some are drawn, the others are told to retry.
TEST_P(RenderLimitsTest, ASessionThatAsksForTooManyAtOnceIsToldSo) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  std::atomic<int> drawn = 0, refused = 0;
  std::vector<std::thread> clients;
  for (int k = 0; k < 10; ++k) {
    clients.emplace_back([&] {
      v1::RenderRequest request = Picture(ids);
      request.set_width_px(1024);
      request.set_height_px(1024);
      const grpc::Status status = Refusal(request);
      if (status.ok()) ++drawn;
      refused += ReasonOf(status) == "TOO_MANY_PICTURES";
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_GE(drawn, 1);
  EXPECT_GE(refused, 1);
  EXPECT_EQ(drawn + refused, 10);
}

INSTANTIATE_TEST_SUITE_P(Backends, RenderLimitsTest, testing::Values("cpu"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Everything but pictures works on a server that cannot draw.
TEST(RenderWithoutEgl, SaysWhatIsMissing) {
  ServerProcess server({"--backend=cpu"}, {{"__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null"}});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session));
  v1::RenderRequest request;
  request.set_session(session);
  request.set_all_cloths(true);
  for (int k = 0; k < 2; ++k) {
    const grpc::Status status = Call(*stub, &Stub::Render, request).status;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_EQ(ReasonOf(status), "NO_EGL_DEVICE");
    EXPECT_THAT(status.error_message(), HasSubstr("cannot draw pictures"));
  }
  EXPECT_EQ(Step(*stub, StepsOf(session, ids, 2)).steps(0), 2u);
}

}  // namespace
}  // namespace drape::test
