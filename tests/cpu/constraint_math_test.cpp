#include "server/solver/cpu/formulas/constraint_math-inl.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace drape::cpu {
namespace {

// A few roundings of numbers near 1.
constexpr float kFewUlps = 8 * 0x1p-24f;

TEST(LanesTest, TransposeGathersComponents) {
  const LaneVectors t =
      Transpose(Lanes{1, 2, 3, 0}, Lanes{4, 5, 6, 0}, Lanes{7, 8, 9, 0}, Lanes{10, 11, 12, 0});
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(t.x[k], static_cast<float>(3 * k + 1));
    EXPECT_EQ(t.y[k], static_cast<float>(3 * k + 2));
    EXPECT_EQ(t.z[k], static_cast<float>(3 * k + 3));
  }
}

TEST(LanesTest, EveryLaneIsRoundedLikeAScalar) {
  const Lanes v{0.1f, 2.7f, 1e-20f, 12345.678f};
  const Lanes root = Sqrt(v);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(root[k], std::sqrt(v[k]));
  EXPECT_EQ(Dot(Lanes{1, 1e-8f, -1, 5}, Lanes{1, 1, 1, 5}), (1 + 1e-8f) - 1)
      << "lane 3 is no part of a vector and the order is x, y, z";
}

TEST(LanesTest, IsAnyLaneSetSeesEachLane) {
  EXPECT_FALSE(IsAnyLaneSet(Splat(1) < Splat(0)));
  for (int k = 0; k < 4; ++k) {
    Lanes v = Splat(1);
    v[k] = -1;
    EXPECT_TRUE(IsAnyLaneSet(v < Splat(0))) << "lane " << k;
  }
}

// After the impulse the predicted distance is right: C = h (w_i + w_j) |Delta Lambda|.
TEST(ConstraintMathTest, DistanceImpulseRemovesTheError) {
  const float h = 0.01f, w_i = 2, w_j = 3, error = 0.25f;
  const float impulse = HWY_NAMESPACE::DistanceImpulse(error, 1 / h, w_i + w_j);
  EXPECT_LT(impulse, 0) << "too long: pulls";
  EXPECT_NEAR(error + h * (w_i + w_j) * impulse, 0, error * kFewUlps);
}

TEST(ConstraintMathTest, SpringForceOfStretchAndDamping) {
  const Lanes force = SpringForce(Lanes{0, 0, 0, 0}, Lanes{0, 2, 0, 0}, Lanes{1, 0.5f, 0, 0},
                                  Lanes{0, 1.5f, 7, 0}, 1.5f, 10, 3);
  EXPECT_EQ(force[0], 0);
  EXPECT_EQ(force[1], 10 * 0.5f + 3 * 1);
  EXPECT_EQ(force[2], 0);
  const Lanes none =
      SpringForce(Lanes{1, 1, 1, 0}, Lanes{1, 1, 1, 0}, Lanes{}, Lanes{1, 0, 0, 0}, 1.5f, 10, 3);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(none[k], 0);
}

TEST(ConstraintMathTest, GapsAndNormals) {
  const Gap sphere = SphereGap(Lanes{3, 4, 0, 0}, Lanes{}, 2);
  EXPECT_EQ(sphere.gap, 3);
  EXPECT_NEAR(sphere.normal[0], 0.6f, kFewUlps);
  EXPECT_NEAR(sphere.normal[1], 0.8f, kFewUlps);
  const Gap centre = SphereGap(Lanes{1, 1, 1, 0}, Lanes{1, 1, 1, 0}, 2);
  EXPECT_EQ(centre.gap, -2);
  EXPECT_EQ(centre.normal[1], 1) << "a centre pushes along +y";
  const Gap plane = PlaneGap(Lanes{5, 3, 0, 0}, Lanes{0, 1, 0, 0}, Lanes{0, 1, 0, 0}, 0.5f);
  EXPECT_EQ(plane.gap, 1.5f);
}

void ExpectGap(const Gap& actual, float gap, const std::array<float, 3>& normal) {
  EXPECT_NEAR(actual.gap, gap, kFewUlps);
  for (uint32_t k = 0; k < 3; ++k) EXPECT_NEAR(actual.normal[k], normal[k], kFewUlps) << k;
}

TEST(ConstraintMathTest, CapsuleGaps) {
  const auto gap = [](float x, float y, float z) {
    return CapsuleGap(Lanes{x, y, z, 0}, Lanes{-1, 0.5f, 2, 0}, Lanes{4, 0, 0, 0},
                      Lanes{0, 1, 0, 0}, 0.25f);
  };
  ExpectGap(gap(0.7f, 1.5f, 2), 0.75f, {0, 1, 0});
  ExpectGap(gap(2.9f, 0.5f, 1.9f), -0.15f, {0, 0, -1});
  ExpectGap(gap(-3, 0.5f, 2), 1.75f, {-1, 0, 0});
  ExpectGap(gap(3.3f, 0.5f, 2.4f), 0.25f, {0.6f, 0, 0.8f});
  ExpectGap(gap(0.25f, 0.5f, 2), -0.25f, {0, 1, 0});  // on the segment
  const Lanes center{1, 1, 1, 0};
  ExpectGap(CapsuleGap(center, center, Lanes{}, Lanes{0, 1, 0, 0}, 2), -2, {0, 1, 0});
  ExpectGap(CapsuleGap(Lanes{4, 5, 1, 0}, center, Lanes{}, Lanes{0, 1, 0, 0}, 2), 3,
            {0.6f, 0.8f, 0});  // of length 0
}

TEST(ConstraintMathTest, BoxGaps) {
  const std::array<Lanes, 3> axes = {Lanes{1, 0, 0, 0}, Lanes{0, 1, 0, 0}, Lanes{0, 0, 1, 0}};
  const auto gap = [&](float x, float y, float z) {
    return BoxGap(Lanes{x, y, z, 0}, Lanes{1, 2, 3, 0}, Lanes{0.5f, 0.25f, 1, 0}, axes, 0.125f);
  };
  ExpectGap(gap(1.25f, 3, 2.5f), 0.625f, {0, 1, 0});
  ExpectGap(gap(1.8f, 1.35f, 3), 0.375f, {0.6f, -0.8f, 0});
  const float third = 1.0f / 3;
  ExpectGap(gap(1.7f, 2.45f, 4.1f), 0.175f, {2 * third, 2 * third, third});
  ExpectGap(gap(1.5f, 2.25f, 4), -0.125f, {1, 0, 0});  // on the corner: the first face
  ExpectGap(gap(1.1f, 1.9f, 3.2f), -0.275f, {0, -1, 0});
  ExpectGap(gap(1, 2, 3), -0.375f, {0, 1, 0});  // the centre: the nearer, then +
  const std::array<Lanes, 3> turned = {Lanes{0, 1, 0, 0}, Lanes{-1, 0, 0, 0}, Lanes{0, 0, 1, 0}};
  ExpectGap(BoxGap(Lanes{0, 2, 3, 0}, Lanes{1, 2, 3, 0}, Lanes{0.5f, 0.25f, 1, 0}, turned, 0),
            0.75f, {-1, 0, 0});
}

TEST(ConstraintMathTest, ContactsOnlyPush) {
  EXPECT_EQ(ContactImpulse(0, 0.5f, 10), 0) << "open gap";
  EXPECT_EQ(ContactImpulse(0, -0.5f, 10), 5) << "penetration";
  EXPECT_EQ(ContactImpulse(7, 0.5f, 10), 2) << "takes back a part of what it gave";
  EXPECT_EQ(ContactImpulse(3, 0.5f, 10), 0) << "but never pulls";
  EXPECT_EQ(ContactFloor(-1, 0.25f), -0.75f) << "comes out slowly";
  EXPECT_EQ(ContactFloor(-0.125f, 0.25f), 0);
  EXPECT_EQ(ContactFloor(1, 0.25f), 0);
}

TEST(ConstraintMathTest, FrictionSticksInsideTheConeAndSlidesOutside) {
  const Lanes u{0.3f, 0, 0.4f, 0};
  const Lanes stick = FrictionImpulse(Lanes{}, u, 1, 0.6f, 0.5f);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(stick[k], -u[k]);
  const Lanes slide = FrictionImpulse(Lanes{}, u, 0.5f, 0.6f, 0.5f);
  EXPECT_NEAR(Length(slide), 0.5f * 0.5f, kFewUlps);
  EXPECT_LT(Dot(slide, u), 0);
  EXPECT_EQ(Length(FrictionImpulse(Lanes{0.1f, 0, 0, 0}, u, 0, 0.6f, 0.5f)), 0)
      << "a contact that has let go has no friction";
}

TEST(ConstraintMathTest, VelocityAfterContact) {
  const Lanes n{0, 1, 0, 0};
  const Lanes leaving = VelocityAfterContact(Lanes{1, 2, 0, 0}, n, 1, 1);
  EXPECT_EQ(leaving[1], 2) << "what leaves is left alone";
  const Lanes stuck = VelocityAfterContact(Lanes{1, -2, 0, 0}, n, 0.6f, 0.5f);
  EXPECT_EQ(Length(stuck), 0);
  const Lanes slid = VelocityAfterContact(Lanes{3, -2, 0, 0}, n, 0.6f, 0.5f);
  EXPECT_EQ(slid[1], 0);
  EXPECT_NEAR(slid[0], 2, 2 * kFewUlps);
  const Lanes smooth = VelocityAfterContact(Lanes{3, -2, 0, 0}, n, 0, 0);
  EXPECT_EQ(smooth[0], 3);
}

}  // namespace
}  // namespace drape::cpu
