#include "server/solver/self_contact/flat_sheet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/solver/self_contact/closest_points.h"
#include "server/solver/self_contact/contact_surface.h"
#include "tests/self_contact/crumpled.h"
#include "tests/support/garments.h"

namespace drape::test {
namespace {

using self_contact::FlatSheet;
using self_contact::PairKind;
using self_contact::Vector3d;
using self_contact::Vector3f;

std::optional<FlatSheet> SheetOf(const std::vector<Vector3d>& positions,
                                 const std::vector<std::array<uint32_t, 3>>& triangles) {
  return FlatSheet::Of(positions, triangles);
}

// A square of two by two cells.
struct Square {
  std::vector<Vector3d> positions;
  std::vector<std::array<uint32_t, 3>> triangles;

  Square() {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        positions.push_back(Vector3d{1.0 * column, 2, 1.0 * row, 0});
      }
    }
    for (uint32_t row = 0; row < 2; ++row) {
      for (uint32_t column = 0; column < 2; ++column) {
        const uint32_t a = 3 * row + column;
        triangles.push_back({a, a + 3, a + 1});
        triangles.push_back({a + 1, a + 3, a + 4});
      }
    }
  }
};

TEST(FlatSheetTest, IsWhatCoversAConvexPartOfAPlaneOnce) {
  EXPECT_TRUE(SheetOf(Square().positions, Square().triangles).has_value());
  for (const Scene& scene : {Grid(16, 12, 1, 0.75), MeshedGrid(14, 14, 1, 1)}) {
    EXPECT_TRUE(ContactSurface(*scene.model).flat_sheet().has_value());
  }
  EXPECT_TRUE(ContactSurface(*IrregularSheet({}).model).flat_sheet().has_value());
  EXPECT_FALSE(ContactSurface(*Shirt({}).model).flat_sheet().has_value());
  EXPECT_FALSE(ContactSurface(*Dress({}).model).flat_sheet().has_value());
  Square corner;  // one cell less
  corner.triangles.resize(6);
  EXPECT_FALSE(SheetOf(corner.positions, corner.triangles).has_value()) << "not convex";
  Square bent;
  bent.positions[8][1] += 0.01;
  EXPECT_FALSE(SheetOf(bent.positions, bent.triangles).has_value());
  Square turned;
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_FALSE(SheetOf(turned.positions, turned.triangles).has_value());
  Square twice;
  twice.triangles.push_back(twice.triangles[0]);
  EXPECT_FALSE(SheetOf(twice.positions, twice.triangles).has_value());
  Square flipped;  // the middle lies beyond the rim
  flipped.positions[4][0] = 2.5;
  EXPECT_FALSE(SheetOf(flipped.positions, flipped.triangles).has_value());
  Square apart;  // two squares beside each other
  const Square other;
  for (Vector3d p : other.positions) apart.positions.push_back(p + Vector3d{5, 0, 0, 0});
  for (const auto& [i, j, k] : other.triangles) apart.triangles.push_back({i + 9, j + 9, k + 9});
  EXPECT_FALSE(SheetOf(apart.positions, apart.triangles).has_value());
  EXPECT_FALSE(SheetOf({}, {}).has_value());
}

TEST(FlatSheetTest, ARingIsNone) {
  std::vector<Vector3d> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
  constexpr uint32_t kCount = 8;
  for (uint32_t k = 0; k < kCount; ++k) {
    const double angle = 2 * M_PI * k / kCount;
    for (const double radius : {1.0, 2.0}) {
      positions.push_back(Vector3d{radius * std::cos(angle), radius * std::sin(angle), 0, 0});
    }
    const uint32_t a = 2 * k, b = 2 * ((k + 1) % kCount);
    triangles.push_back({a, a + 1, b});
    triangles.push_back({b, a + 1, b + 1});
  }
  EXPECT_FALSE(SheetOf(positions, triangles).has_value());
}

template <class V>
class FlatSheetOf : public ::testing::Test {};
using Precisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(FlatSheetOf, Precisions);

// The largest share, within 0.01, that is promised for this motion.
template <class V>
double PromisedShare(const FlatSheet& sheet, const std::vector<V>& positions,
                     const std::vector<V>& velocities, double duration) {
  using Real = self_contact::ScalarOf<V>;
  double promised = 0;
  for (double share = 0.01; share < 2; share += 0.01) {
    if (sheet.KeepsApart<V>(positions, velocities, Real(duration), Real(share))) promised = share;
  }
  return promised;
}

// Bent, sheared, stretched, turned and moved at random: nothing comes nearer than was promised, and
// something was promised of most.
TYPED_TEST(FlatSheetOf, KeepsItsPromise) {
  using V = TypeParam;
  constexpr double kDuration = 1.0 / 60;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  int promised_count = 0, tried = 0;
  for (const Scene& scene :
       {Grid(9, 7, 1, 0.75), MeshedGrid(7, 7, 1, 1), IrregularSheet({.cell_m = 0.15})}) {
    const ContactSurface surface(*scene.model);
    ASSERT_TRUE(surface.flat_sheet().has_value());
    for (int turn = 0; turn < 24; ++turn) {
      // Waves of some height and length, a shear, a shift far away, a swing, and jitter.
      const double bend = 0.3 * unit(random) * unit(random), waves = 2 * unit(random);
      const double shear = 0.3 * unit(random), stretch = 1 + 0.2 * unit(random);
      const double jitter = turn % 3 == 0 ? 5e-3 : 0, swing = 8 * unit(random);
      const Eigen::Matrix3d rotation =
          Eigen::AngleAxisd(3 * unit(random),
                            Eigen::Vector3d(unit(random), unit(random), 1).normalized())
              .toRotationMatrix();
      const Eigen::Vector3d shift(20 * unit(random), 5 * unit(random), 20 * unit(random));
      std::vector<Vector3d> exact, velocities;
      for (const Eigen::Vector3d& p : scene.model->rest_positions_m()) {
        const Eigen::Vector3d shaken(jitter * unit(random), jitter * unit(random),
                                     jitter * unit(random));
        const double x = p.x(), y = p.y() + p.z();  // in their planes
        const Eigen::Vector3d bent(stretch * x + shear * y, bend * std::sin(3 * waves * x + 2 * y),
                                   y);
        exact.push_back(self_contact::ToVector<Vector3d>(rotation * (bent + shaken) + shift));
        const Eigen::Vector3d velocity(swing * y, 3 * unit(random) * jitter * 60, swing * x);
        velocities.push_back(self_contact::ToVector<Vector3d>(velocity));
      }
      const double promised =
          PromisedShare<V>(*surface.flat_sheet(), As<V>(exact), As<V>(velocities), kDuration);
      ++tried;
      if (promised == 0) continue;
      ++promised_count;
      for (const double share_of_time : {0.0, 0.5, 1.0}) {
        std::vector<Vector3d> later = exact;
        for (size_t i = 0; i < later.size(); ++i) {
          later[i] += share_of_time * kDuration * velocities[i];
        }
        ForAllPairs(surface, [&](PairKind kind, const std::array<uint32_t, 4>& particles) {
          const auto corners = [&](const auto& all) {
            return std::array<Vector3d, 4>{all[particles[0]], all[particles[1]], all[particles[2]],
                                           all[particles[3]]};
          };
          const double at_rest = self_contact::Length(
              self_contact::Closest(kind, corners(surface.rest_positions())).difference);
          const double now =
              self_contact::Length(self_contact::Closest(kind, corners(later)).difference);
          ASSERT_GE(now, promised * at_rest) << "turn " << turn;
          ASSERT_GE(at_rest, surface.flat_sheet()->least_gap_m() * (1 - 1e-12));
        });
      }
    }
  }
  EXPECT_GT(promised_count, tried / 2);
}

TYPED_TEST(FlatSheetOf, PromisesNothingOfWhatFoldsOrMeets) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  const Scene scene = Grid(9, 9, 1, 1);
  const ContactSurface surface(*scene.model);
  const FlatSheet& sheet = *surface.flat_sheet();
  std::vector<Vector3d> flat(surface.rest_positions().begin(), surface.rest_positions().end());
  const std::vector<V> resting(flat.size(), V{});
  EXPECT_TRUE(sheet.KeepsApart<V>(As<V>(flat), resting, Real(1), Real(0.9)));
  std::vector<Vector3d> folded = flat;
  for (Vector3d& p : folded) {
    if (p[0] > 0.5) p = Vector3d{1 - p[0], 0.01, p[2], 0};
  }
  EXPECT_FALSE(sheet.KeepsApart<V>(As<V>(folded), resting, Real(1), Real(0.01)));
  std::vector<Vector3d> shrinking;
  for (const Vector3d& p : flat) shrinking.push_back(-p);
  EXPECT_TRUE(sheet.KeepsApart<V>(As<V>(flat), As<V>(shrinking), Real(0.1), Real(0.5)));
  EXPECT_FALSE(sheet.KeepsApart<V>(As<V>(flat), As<V>(shrinking), Real(1), Real(0.01)));
  std::vector<Vector3d> unknown = flat;
  unknown[40][1] = std::nan("");
  EXPECT_FALSE(sheet.KeepsApart<V>(As<V>(unknown), resting, Real(1), Real(0.01)));
}

}  // namespace
}  // namespace drape::test
