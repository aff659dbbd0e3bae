#include "server/solver/cpu/formulas/constraint_math-inl.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "server/solver/cpu/formulas/contact_math-inl.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // of the formulas; nothing here depends on which one it is
using PointGap = Gaps<float, Vec4>;

// A few roundings of numbers near 1.
constexpr float kFewUlps = 8 * 0x1p-24f;

TEST(Vec4Test, TransposeGathersComponents) {
  const Vectors4 t =
      Transpose(Vec4{1, 2, 3, 0}, Vec4{4, 5, 6, 0}, Vec4{7, 8, 9, 0}, Vec4{10, 11, 12, 0});
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(t.x[k], static_cast<float>(3 * k + 1));
    EXPECT_EQ(t.y[k], static_cast<float>(3 * k + 2));
    EXPECT_EQ(t.z[k], static_cast<float>(3 * k + 3));
  }
}

TEST(Vec4Test, EveryLaneIsRoundedLikeAScalar) {
  const Vec4 v{0.1f, 2.7f, 1e-20f, 12345.678f};
  const Vec4 root = Sqrt(v);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(root[k], std::sqrt(v[k]));
  EXPECT_EQ(Dot(Vec4{1, 1e-8f, -1, 5}, Vec4{1, 1, 1, 5}), (1 + 1e-8f) - 1)
      << "lane 3 is no part of a vector and the order is x, y, z";
}

TEST(Vec4Test, IsAnyLaneSetSeesEachLane) {
  EXPECT_FALSE(IsAnyLaneSet(Splat(1) < Splat(0)));
  for (int k = 0; k < 4; ++k) {
    Vec4 v = Splat(1);
    v[k] = -1;
    EXPECT_TRUE(IsAnyLaneSet(v < Splat(0))) << "lane " << k;
  }
}

// After the impulse the predicted distance is right: C = h (w_i + w_j) |Delta Lambda|.
TEST(ConstraintMathTest, DistanceImpulseRemovesTheError) {
  const float h = 0.01f, w_i = 2, w_j = 3, error = 0.25f;
  const float impulse = DistanceImpulse(error, 1 / h, w_i + w_j);
  EXPECT_LT(impulse, 0) << "too long: pulls";
  EXPECT_NEAR(error + h * (w_i + w_j) * impulse, 0, error * kFewUlps);
}

TEST(ConstraintMathTest, SpringForceOfStretchAndDamping) {
  const Vec4 force = SpringForce(Vec4{0, 2, 0, 0}, Vec4{-1, 1, 7, 0}, 1.5f, 10, 3);
  EXPECT_EQ(force[0], 0);
  EXPECT_EQ(force[1], 10 * 0.5f + 3 * 1);
  EXPECT_EQ(force[2], 0);
  const Vec4 none = SpringForce(Vec4{}, Vec4{1, 0, 0, 0}, 1.5f, 10, 3);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(none[k], 0);
}

TEST(ConstraintMathTest, GapsAndNormals) {
  const PointGap sphere = SphereGap(Vec4{3, 4, 0, 0}, Vec4{}, 2.0f);
  EXPECT_EQ(sphere.gap, 3);
  EXPECT_NEAR(sphere.normal[0], 0.6f, kFewUlps);
  EXPECT_NEAR(sphere.normal[1], 0.8f, kFewUlps);
  const PointGap centre = SphereGap(Vec4{1, 1, 1, 0}, Vec4{1, 1, 1, 0}, 2.0f);
  EXPECT_EQ(centre.gap, -2);
  EXPECT_EQ(centre.normal[1], 1) << "a centre pushes along +y";
  const PointGap plane = PlaneGap(Vec4{5, 3, 0, 0}, Vec4{0, 1, 0, 0}, Vec4{0, 1, 0, 0}, 0.5f);
  EXPECT_EQ(plane.gap, 1.5f);
}

void ExpectGap(const PointGap& actual, float gap, const std::array<float, 3>& normal) {
  EXPECT_NEAR(actual.gap, gap, kFewUlps);
  for (uint32_t k = 0; k < 3; ++k) EXPECT_NEAR(actual.normal[k], normal[k], kFewUlps) << k;
}

TEST(ConstraintMathTest, CapsuleGaps) {
  const auto gap = [](float x, float y, float z) {
    return CapsuleGap(Vec4{x, y, z, 0}, Vec4{-1, 0.5f, 2, 0}, Vec4{4, 0, 0, 0}, Vec4{0, 1, 0, 0},
                      0.25f);
  };
  ExpectGap(gap(0.7f, 1.5f, 2), 0.75f, {0, 1, 0});
  ExpectGap(gap(2.9f, 0.5f, 1.9f), -0.15f, {0, 0, -1});
  ExpectGap(gap(-3, 0.5f, 2), 1.75f, {-1, 0, 0});
  ExpectGap(gap(3.3f, 0.5f, 2.4f), 0.25f, {0.6f, 0, 0.8f});
  ExpectGap(gap(0.25f, 0.5f, 2), -0.25f, {0, 1, 0});  // on the segment
  const Vec4 center{1, 1, 1, 0};
  ExpectGap(CapsuleGap(center, center, Vec4{}, Vec4{0, 1, 0, 0}, 2.0f), -2, {0, 1, 0});
  ExpectGap(CapsuleGap(Vec4{4, 5, 1, 0}, center, Vec4{}, Vec4{0, 1, 0, 0}, 2.0f), 3,
            {0.6f, 0.8f, 0});  // of length 0
}

TEST(ConstraintMathTest, BoxGaps) {
  const std::array<Vec4, 3> axes = {Vec4{1, 0, 0, 0}, Vec4{0, 1, 0, 0}, Vec4{0, 0, 1, 0}};
  const auto gap = [&](float x, float y, float z) {
    return BoxGap(Vec4{x, y, z, 0}, Vec4{1, 2, 3, 0}, std::array{0.5f, 0.25f, 1.0f}, axes, 0.125f);
  };
  ExpectGap(gap(1.25f, 3, 2.5f), 0.625f, {0, 1, 0});
  ExpectGap(gap(1.8f, 1.35f, 3), 0.375f, {0.6f, -0.8f, 0});
  const float third = 1.0f / 3;
  ExpectGap(gap(1.7f, 2.45f, 4.1f), 0.175f, {2 * third, 2 * third, third});
  ExpectGap(gap(1.5f, 2.25f, 4), -0.125f, {1, 0, 0});  // on the corner: the first face
  ExpectGap(gap(1.1f, 1.9f, 3.2f), -0.275f, {0, -1, 0});
  ExpectGap(gap(1, 2, 3), -0.375f, {0, 1, 0});  // the centre: the nearer, then +
  const std::array<Vec4, 3> turned = {Vec4{0, 1, 0, 0}, Vec4{-1, 0, 0, 0}, Vec4{0, 0, 1, 0}};
  ExpectGap(BoxGap(Vec4{0, 2, 3, 0}, Vec4{1, 2, 3, 0}, std::array{0.5f, 0.25f, 1.0f}, turned, 0.0f),
            0.75f, {-1, 0, 0});
}

TEST(ConstraintMathTest, CylinderGaps) {
  const Vec4 center{1, 0.5f, 2, 0}, axis{1, 0, 0, 0}, axis_normal{0, 1, 0, 0};
  const auto gap = [&](float x, float y, float z) {
    return CylinderGap(Vec4{x, y, z, 0}, center, axis, axis_normal, 0.25f, 2.0f, 0.375f);
  };
  ExpectGap(gap(0.7f, 1.5f, 2), 0.625f, {0, 1, 0});
  ExpectGap(gap(-3, 0.5f, 2), 1.875f, {-1, 0, 0});
  ExpectGap(gap(-1.5f, 0.6f, 2.1f), 0.375f, {-1, 0, 0});       // above an end
  ExpectGap(gap(3.3f, 0.5f, 2.65f), 0.375f, {0.6f, 0, 0.8f});  // beyond the rim
  ExpectGap(gap(1, 0.5f, 1.9f), -0.275f, {0, 0, -1});
  ExpectGap(gap(2.95f, 0.6f, 2), -0.175f, {1, 0, 0});
  ExpectGap(gap(1, 0.5f, 2), -0.375f, {0, 1, 0});      // on the axis
  ExpectGap(gap(3, 0.5f, 2.25f), -0.125f, {0, 0, 1});  // on the rim: the side
}

TEST(ConstraintMathTest, ContactsOnlyPush) {
  EXPECT_EQ(ContactImpulse(0.0f, 0.5f, 10), 0) << "open gap";
  EXPECT_EQ(ContactImpulse(0.0f, -0.5f, 10), 5) << "penetration";
  EXPECT_EQ(ContactImpulse(7.0f, 0.5f, 10), 2) << "takes back a part of what it gave";
  EXPECT_EQ(ContactImpulse(3.0f, 0.5f, 10), 0) << "but never pulls";
  EXPECT_EQ(ContactFloor(-1.0f, 0.25f), -0.75f) << "comes out slowly";
  EXPECT_EQ(ContactFloor(-0.125f, 0.25f), 0);
  EXPECT_EQ(ContactFloor(1.0f, 0.25f), 0);
}

TEST(ConstraintMathTest, FrictionSticksInsideTheConeAndSlidesOutside) {
  const Vec4 wanted{0.3f, 0, 0.4f, 0};
  const auto impulse = [&](float beta_normal) {
    const float size = Length(wanted);
    return FrictionImpulse(wanted, size, beta_normal,
                           FrictionAtOnce(size, beta_normal, 0.6f, 0.5f));
  };
  const Vec4 stick = impulse(1.0f);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(stick[k], wanted[k]);
  const Vec4 slide = impulse(0.5f);
  EXPECT_NEAR(Length(slide), 0.5f * 0.5f, kFewUlps);
  EXPECT_GT(Dot(slide, wanted), 0);
  EXPECT_EQ(Length(impulse(0)), 0) << "a contact that has let go has no friction";
}

TEST(ConstraintMathTest, WhatSlidesIsFasterThanStaticFrictionStopsSoon) {
  EXPECT_FLOAT_EQ(SlipSpeed(0.5f, 0.002f, 0.003f), 0.009f) << "the weight";
  EXPECT_FLOAT_EQ(SlipSpeed(0.5f, 0.01f, 0.003f), 0.03f) << "the pressure";
  EXPECT_FLOAT_EQ(SlipSpeed(0.5f, 10.0f, 0.003f), 0.05f) << "at most";
}

// Coefficients s and d of what slips at once.
auto AtOnce(float s, float d) {
  return [=](float size, float beta_normal) { return FrictionAtOnce(size, beta_normal, s, d); };
}

// After sweeps that made no impulse, with friction coefficients s and d.
Vec4 AfterContact(Vec4 v, float rebound, float s, float d) {
  return VelocityAfterContact(v, Vec4{0, 1, 0, 0}, Vec4{}, Vec4{}, 0.0f, rebound, false,
                              AtOnce(s, d));
}

TEST(ConstraintMathTest, VelocityAfterContact) {
  EXPECT_EQ(AfterContact(Vec4{1, 2, 0, 0}, 0, 1, 1)[1], 2) << "what leaves is left alone";
  EXPECT_EQ(Length(AfterContact(Vec4{1, -2, 0, 0}, 0, 0.6f, 0.5f)), 0);
  const Vec4 slid = AfterContact(Vec4{3, -2, 0, 0}, 0, 0.6f, 0.5f);
  EXPECT_EQ(slid[1], 0);
  EXPECT_NEAR(slid[0], 2, 2 * kFewUlps);
  EXPECT_EQ(AfterContact(Vec4{3, -2, 0, 0}, 0, 0, 0)[0], 3);
  const Vec4 rebounding = AfterContact(Vec4{3, -2, 0, 0}, 0.5f, 0.6f, 0.5f);
  EXPECT_EQ(rebounding[1], 0.5f);
  EXPECT_NEAR(rebounding[0], 1.75f, 2 * kFewUlps) << "friction of an impulse of 2.5";
}

// With two steps. Neither the sweeps' impulse of 1 nor the rest of 2 alone stops a speed of 1.5
// that is in the cone of both.
TEST(ConstraintMathTest, FrictionOfTwoStepsIsJudgedOnTheWholeImpulse) {
  const auto after = [](float friction_static, float friction_dynamic) {
    // Friction of 0.6 times 1 has left 0.9.
    return VelocityAfterContact(Vec4{0.9f, -2, 0, 0}, Vec4{0, 1, 0, 0}, Vec4{},
                                Vec4{-0.6f, 0, 0, 0}, 1.0f, 0.0f, true,
                                AtOnce(friction_static, friction_dynamic));
  };
  EXPECT_EQ(Length(after(0.7f, 0.6f)), 0);
  EXPECT_NEAR(after(0.4f, 0.3f)[0], 1.5f - 0.3f * 3, 2 * kFewUlps);
}

// With two steps the normal speed is what removed the error, whatever its sign.
TEST(ConstraintMathTest, TwoStepsLeaveExactlyTheRebound) {
  const Vec4 n{0, 1, 0, 0};
  const Vec4 v =
      VelocityAfterContact(Vec4{1, 2, 0, 0}, n, Vec4{}, Vec4{}, 3.0f, 0.0f, true, AtOnce(0, 0));
  EXPECT_EQ(v[0], 1);
  EXPECT_EQ(v[1], 0);
  EXPECT_TRUE(IsLanding(n, Vec4{0, -1, 0, 0}, 0.5f));
  EXPECT_FALSE(IsLanding(n, Vec4{0, -0.4f, 0, 0}, 0.5f));
  EXPECT_FALSE(IsLanding(n, Vec4{100, -0.05f, 0, 0}, 0.0f)) << "it grazes";
}

}  // namespace
}  // namespace drape::cpu
