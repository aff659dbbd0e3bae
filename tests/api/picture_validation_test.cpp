#include "server/api/picture_validation.h"

#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::BadCase;
using test::ExpectViolation;
using test::GoodPicture;
using test::kInfinity;
using test::kNaN;
using test::NameOf;
using test::Set;

using BadPicture = BadCase<v1::RenderRequest>;
class RenderValidation : public testing::TestWithParam<BadPicture> {};

TEST_P(RenderValidation, NamesFieldValueAndRange) {
  v1::RenderRequest request = GoodPicture();
  ASSERT_TRUE(CheckRender(request).ok());
  GetParam().spoil(request);
  const auto checked = CheckRender(request);
  ASSERT_FALSE(checked.ok());
  ExpectViolation(checked.status(), GetParam().field, GetParam().text);
  EXPECT_EQ(checked.status().violations().size(), 1u) << checked.status().ToString();
}

v1::Camera& Camera(v1::RenderRequest& request) {
  return *request.mutable_camera();
}

// In place of the camera.
v1::RenderRequest::Fit& Fit(v1::RenderRequest& request) {
  request.clear_camera();
  return *request.mutable_fit();
}

INSTANTIATE_TEST_SUITE_P(
    SizeAndCamera, RenderValidation,
    testing::Values(
        BadPicture{"Narrow", [](auto& r) { r.set_width_px(15); }, "width_px",
                   "15 is not in [16, 4096]"},
        BadPicture{"Wide", [](auto& r) { r.set_width_px(4097); }, "width_px", "4097"},
        BadPicture{"NoHeight", [](auto& r) { r.set_height_px(0); }, "height_px",
                   "0 is not in [16, 4096]"},
        BadPicture{"High", [](auto& r) { r.set_height_px(4294967295u); }, "height_px",
                   "4294967295"},
        BadPicture{"TwoSamples", [](auto& r) { r.set_samples(2); }, "samples",
                   "2: 1 or 4 are allowed"},
        BadPicture{"NoEye", [](auto& r) { Camera(r).clear_eye_m(); }, "camera.eye_m",
                   "has 0 elements, needs 3"},
        BadPicture{"EyeNotANumber",
                   [](auto& r) {
                     Set(Camera(r).mutable_eye_m(), {0, kNaN, 0});
                   },
                   "camera.eye_m[1]", "nan"},
        BadPicture{"TargetInfinite",
                   [](auto& r) {
                     Set(Camera(r).mutable_target_m(), {kInfinity, 0, 0});
                   },
                   "camera.target_m[0]", "inf is not in [-1e+12, 1e+12]"},
        BadPicture{"LooksAtItself",
                   [](auto& r) { *Camera(r).mutable_target_m() = Camera(r).eye_m(); },
                   "camera.target_m", "is 0 m from eye_m: at least 1e-06 m"},
        BadPicture{"UpHasNoLength",
                   [](auto& r) {
                     Set(Camera(r).mutable_up(), {0, 0, 0});
                   },
                   "camera.up", "has no direction"},
        BadPicture{"UpIsFlat",
                   [](auto& r) {
                     Set(Camera(r).mutable_up(), {0, 1});
                   },
                   "camera.up", "has 2 elements"},
        BadPicture{"UpAlongTheView",
                   [](auto& r) {
                     Set(Camera(r).mutable_target_m(), {1, 1, 1});
                     Set(Camera(r).mutable_up(), {0, 0, 5});
                   },
                   "camera.up", "rad from the line of view: at least 0.001"},
        BadPicture{"UsualUpAlongTheView",
                   [](auto& r) {
                     Set(Camera(r).mutable_target_m(), {1, 0, 3});
                     Camera(r).clear_up();
                   },
                   "camera.up", "is 0 rad from the line of view"},
        BadPicture{"NarrowView", [](auto& r) { Camera(r).set_vertical_field_of_view_rad(0); },
                   "camera.vertical_field_of_view_rad", "0 is not in [0.01, 3] rad"},
        BadPicture{"ViewNotANumber",
                   [](auto& r) { Camera(r).set_vertical_field_of_view_rad(kNaN); },
                   "camera.vertical_field_of_view_rad", "nan"},
        BadPicture{"CameraAndFit", [](auto& r) { r.mutable_fit(); }, "fit", "a camera is given"}),
    NameOf());

INSTANTIATE_TEST_SUITE_P(
    FitAndColours, RenderValidation,
    testing::Values(BadPicture{"NoDirection",
                               [](auto& r) {
                                 Set(Fit(r).mutable_view_direction(), {0, 0, 0});
                               },
                               "fit.view_direction", "has no direction"},
                    BadPicture{"DirectionNotANumber",
                               [](auto& r) {
                                 Set(Fit(r).mutable_view_direction(), {1, 0, kNaN});
                               },
                               "fit.view_direction[2]", "nan"},
                    BadPicture{"HalfABox",
                               [](auto& r) {
                                 Set(Fit(r).mutable_include_m(), {0, 0, 0});
                               },
                               "fit.include_m", "has 3 elements, needs 6"},
                    BadPicture{"BoxInsideOut",
                               [](auto& r) {
                                 Set(Fit(r).mutable_include_m(), {0, 2, 0, 1, 1, 1});
                               },
                               "fit.include_m[1]", "2 is above element 4, 1"},
                    BadPicture{"BoxNotANumber",
                               [](auto& r) {
                                 Set(Fit(r).mutable_include_m(), {0, 0, 0, 1, kNaN, 1});
                               },
                               "fit.include_m[4]", "nan"},
                    BadPicture{"UnknownColouring",
                               [](auto& r) {
                                 r.clear_range();
                                 r.set_colouring(static_cast<v1::RenderRequest::Colouring>(9));
                               },
                               "colouring",
                               "9 is not a known value of Colouring (MATERIAL, STRAIN"},
                    BadPicture{"RangeOfNothing",
                               [](auto& r) { r.set_colouring(v1::RenderRequest::MATERIAL); },
                               "range", "only STRAIN, SPEED and CONTACT"},
                    BadPicture{"HalfARange", [](auto& r) { Set(r.mutable_range(), {1}); }, "range",
                               "has 1 elements, needs 2"},
                    BadPicture{"EmptyRange",
                               [](auto& r) {
                                 Set(r.mutable_range(), {1, 1});
                               },
                               "range", "[1, 1]: the second must be larger"},
                    BadPicture{"RangeInSinglePrecision",
                               [](auto& r) {
                                 Set(r.mutable_range(), {1000, 1000.001});
                               },
                               "range", "by at least 0.01"},
                    BadPicture{"RangeUpsideDown",
                               [](auto& r) {
                                 Set(r.mutable_range(), {1, -1});
                               },
                               "range", "[1, -1]"},
                    BadPicture{"RangeNotANumber",
                               [](auto& r) {
                                 Set(r.mutable_range(), {kNaN, 1});
                               },
                               "range[0]", "nan"}),
    NameOf());

TEST(CheckRender, NothingAskedForIsAPictureWithTheDefaults) {
  const auto spec = CheckRender({});
  ASSERT_TRUE(spec.ok());
  EXPECT_EQ(spec->width_px, 960u);
  EXPECT_EQ(spec->height_px, 720u);
  EXPECT_FALSE(spec->camera.has_value());
  EXPECT_TRUE(spec->include_m.isEmpty());
  EXPECT_EQ(spec->view_direction, render::PictureSpec().view_direction);
  EXPECT_EQ(spec->colouring, render::Colouring::kMaterial);
  EXPECT_FALSE(spec->range.has_value());
  EXPECT_TRUE(spec->has_legend && spec->has_colliders && spec->has_pins && spec->has_shadows);
  EXPECT_EQ(spec->samples, 4u);
}

TEST(CheckRender, EveryFieldArrives) {
  const auto spec = CheckRender(GoodPicture());
  ASSERT_TRUE(spec.ok());
  EXPECT_EQ(spec->width_px, 200u);
  EXPECT_EQ(spec->height_px, 100u);
  EXPECT_EQ(spec->camera->eye_m, Eigen::Vector3d(1, 1, 3));
  EXPECT_EQ(spec->camera->target_m, Eigen::Vector3d(1, 0.5, 0));
  EXPECT_EQ(spec->camera->up, Eigen::Vector3d::UnitX()) << "of length 1";
  EXPECT_EQ(spec->camera->vertical_field_of_view_rad, 0.5);
  EXPECT_EQ(spec->colouring, render::Colouring::kStrain);
  EXPECT_EQ(spec->range->low, -0.1);
  EXPECT_EQ(spec->range->high, 0.2);
  EXPECT_FALSE(spec->has_legend || spec->has_colliders || spec->has_pins || spec->has_shadows);
  EXPECT_EQ(spec->samples, 1u);
}

TEST(CheckRender, AFitArrives) {
  v1::RenderRequest request = GoodPicture();
  Set(Fit(request).mutable_view_direction(), {0, -1e12, 0});
  Set(Fit(request).mutable_include_m(), {-1, 0, 1, -1, 2, 3});
  const auto spec = CheckRender(request);
  ASSERT_TRUE(spec.ok());
  EXPECT_EQ(spec->view_direction, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(spec->include_m.min(), Eigen::Vector3d(-1, 0, 1));
  EXPECT_EQ(spec->include_m.max(), Eigen::Vector3d(-1, 2, 3));
}

TEST(CheckRender, TilesHaveACameraAndALimit) {
  v1::RenderRequest request;
  request.set_tiles(true);
  ExpectViolation(CheckRender(request).status(), "camera", "is needed for tiles");
  for (const double number : {0.0, 1.0, 2.0}) request.mutable_camera()->add_eye_m(number);
  for (const double number : {0.0, 0.0, 0.0}) request.mutable_camera()->add_target_m(number);
  request.set_width_px(128);
  request.set_height_px(64);
  request.set_encoding(v1::RenderRequest::RGB8);
  const auto spec = CheckRender(request);
  ASSERT_TRUE(spec.ok()) << spec.status().ToString();
  EXPECT_TRUE(spec->is_tiled && spec->is_raw);
  EXPECT_TRUE(CheckTiles(*spec, 2048).ok());
  ExpectViolation(CheckTiles(*spec, 2049), "tiles", "16785408 pixels together, at most 16777216");
  request.set_depths(true);
  EXPECT_TRUE(CheckTiles(*CheckRender(request), 1024).ok());
  ExpectViolation(CheckTiles(*CheckRender(request), 1025), "tiles", "at most 8388608 with depths");
  request.set_depths(false);
  request.set_encoding(static_cast<v1::RenderRequest::Encoding>(7));
  ExpectViolation(CheckRender(request).status(), "encoding", "7");
  request.set_tiles(false);
  request.set_encoding(v1::RenderRequest::PNG);
  EXPECT_FALSE(CheckRender(request)->is_raw);
  EXPECT_TRUE(CheckTiles(*CheckRender(request), 1u << 20).ok()) << "one picture, however many";
}

TEST(CheckRender, AllViolationsAreNamedAtOnce) {
  v1::RenderRequest request = GoodPicture();
  request.set_width_px(1);
  request.set_height_px(1);
  Camera(request).clear_eye_m();
  const auto checked = CheckRender(request);
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(checked.status().violations().size(), 3u);
}

}  // namespace
}  // namespace drape::api
