// Boxes, cylinders and capsules on each other (server/solver/bodies/convex_pair.h): face on face
// and flush, edge over edge, thin things that are thrown at each other.
#include <cmath>
#include <random>
#include <vector>

#include "server/scene/distance_map.h"
#include "tests/physics/body_scene.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

class BodyStack : public BodyTest {
 protected:
  // All bodies stay where they start, for as long as a free fall of 0.2 m takes.
  void ExpectRest(const Scene& scene, double tolerance_m) {
    StepFor(scene, 0.2);
    for (const BodyState& state : *report_.bodies) {
      const RigidMotion& begin = scene.parameters.collider_motions[state.collider];
      EXPECT_LE((state.motion.position_m - begin.position_m).norm(), tolerance_m) << state.collider;
      EXPECT_LE(state.motion.rotation.angularDistance(begin.rotation), tolerance_m / 0.01)
          << state.collider;
    }
  }
  void ExpectColumnsRest(unsigned seed, int columns);
};
INSTANTIATE_TEST_SUITE_P(Backends, BodyStack, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// What is `off` a place that lies on it comes to be there, and rounding of that.
double RestingTolerance(const Vector3d& place_m) {
  return 1e-9 + 1e-13 * place_m.norm();
}

Scene WithFriction() {
  Scene scene = Nothing();
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  return scene;
}

Collider Cube(const Vector3d& centre_m, double half_m, double mass_kg) {
  Collider cube = BoxAt(centre_m, Vector3d::Constant(half_m));
  cube.mass_kg = mass_kg;
  return cube;
}

// Of few cells: what is convex and flat touches as what it is.
Collider Crate(const Vector3d& centre_m, double half_m, double mass_kg) {
  DistanceMapSettings coarse;
  coarse.resolution = 8;
  const auto map =
      DistanceMap::Build(BoxMesh(Vector3d::Constant(-half_m), Vector3d::Constant(half_m)), coarse);
  Collider crate = DistanceMapAt(map.value(), {.position_m = centre_m});
  crate.mass_kg = mass_kg;
  return crate;
}

Collider Can(const Vector3d& base_m, double height_m, double radius_m) {
  Collider can = CylinderBetween(base_m, base_m + Vector3d(0, height_m, 0), radius_m);
  can.mass_kg = 1;
  return can;
}

// Corners exactly over corners, edges over edges, rims over rims.
TEST_P(BodyStack, WhatLiesFlushRests) {
  for (const Vector3d& place : {Vector3d(0, 0, 0), Vector3d(-30, 0, 80)}) {
    Scene scene = WithFriction();
    // On a pedestal as wide as they are, which no impulse moves.
    AddBody(scene, BoxAt(place + Vector3d(0, 0.05, 0), Vector3d::Constant(0.05)));
    for (int k = 1; k < 4; ++k) {
      AddBody(scene, Cube(place + Vector3d(0, 0.05 + 0.1 * k, 0), 0.05, 1));
    }
    // Cans on each other and on the floor; cubes beside them, faces on faces.
    for (int k = 0; k < 3; ++k) {
      AddBody(scene, Can(place + Vector3d(1, 0.1 * k, 0), 0.1, 0.04));
      AddBody(scene, Cube(place + Vector3d(2 + 0.1 * k, 0.05, 0), 0.05, 1));
    }
    // Crates of a mesh on each other and on a cube, the upper ones a little aside.
    AddBody(scene, Cube(place + Vector3d(3, 0.05, 0), 0.05, 1));
    AddBody(scene, Crate(place + Vector3d(3, 0.15, 0), 0.05, 1));
    AddBody(scene, Crate(place + Vector3d(3.02, 0.25, 0.01), 0.05, 1));
    AddBody(scene, Cube(place + Vector3d(3.02, 0.35, 0.02), 0.05, 1));
    AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
    ExpectRest(scene, RestingTolerance(place));
  }
}

// Boxes and cans of any size, turned about the vertical, each with its centre well over the one
// below and no heavier than that: no part of such a column can fall.
void BodyStack::ExpectColumnsRest(unsigned seed, int columns) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int column = 0; column < columns; ++column) {
    SCOPED_TRACE(column);
    Scene scene = WithFriction();
    const Vector3d place(between(-50, 50), 0, between(-50, 50));
    double top = 0, mass = 3;
    Vector3d centre = place;
    double room = 0.1;
    for (int k = 0; k < 4; ++k) {
      const double half_height = between(0.02, 0.08), half_width = between(0.04, 0.08);
      // In the circle that every outline contains, so that three above it may lean one way.
      centre += room / 5 * Vector3d(between(-0.7, 0.7), 0, between(-0.7, 0.7));
      room = half_width;
      Collider solid;
      if (column % 3 == 0 || between(0, 1) < 0.6) {
        const double other_half = between(half_width, 0.1);
        solid = BoxAt(Vector3d(centre.x(), top + half_height, centre.z()),
                      {half_width, half_height, other_half},
                      Quaterniond(AngleAxisd(between(-3, 3), Vector3d::UnitY())));
      } else {
        solid = Can(Vector3d(centre.x(), top, centre.z()), 2 * half_height, half_width);
      }
      mass *= between(0.3, 0.9);
      solid.mass_kg = mass;
      AddBody(scene, solid);
      top += 2 * half_height;
    }
    AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d::UnitY()));
    ExpectRest(scene, RestingTolerance(place));
  }
}

TEST_P(BodyStack, RandomColumnsRest) {
  ExpectColumnsRest(11, 4);
}

class BodyStackLong : public BodyStack {};
INSTANTIATE_TEST_SUITE_P(Backends, BodyStackLong, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(BodyStackLong, RandomColumnsRest) {
  ExpectColumnsRest(1, 60);
}

// A beam across a beam, and round ones across both: no corner is near. Each lies on the middle of
// the one below.
TEST_P(BodyStack, WhatCrossesRests) {
  for (const double angle : {M_PI / 2, 1.0, 0.3}) {
    const Vector3d way(std::cos(angle), 0, std::sin(angle));
    const auto capsule_at = [&](double y) {
      return CapsuleBetween(Vector3d(0, y, 0) - 0.3 * way, Vector3d(0, y, 0) + 0.3 * way, 0.03);
    };
    const auto cylinder_at = [&](double y) {
      return CylinderBetween(Vector3d(0, y, 0) - 0.3 * way, Vector3d(0, y, 0) + 0.3 * way, 0.03);
    };
    const auto beam_at = [&](double y) {
      return BoxAt({0, y, 0}, {0.3, 0.03, 0.02},
                   Quaterniond(AngleAxisd(-angle, Vector3d::UnitY())));
    };
    for (const Collider& above : {beam_at(0.09), capsule_at(0.09), cylinder_at(0.09)}) {
      for (const Collider& below : {BoxAt({0, 0.03, 0}, {0.3, 0.03, 0.02}),
                                    CapsuleBetween({-0.3, 0.03, 0}, {0.3, 0.03, 0}, 0.03),
                                    CylinderBetween({-0.3, 0.03, 0}, {0.3, 0.03, 0}, 0.03)}) {
        SCOPED_TRACE(testing::Message() << angle << ' ' << kShapeNames[above.shape.index()]
                                        << " on " << kShapeNames[below.shape.index()]);
        Scene scene = WithFriction();
        Collider body = above;
        body.mass_kg = 1;
        AddBody(scene, body);
        AddBody(scene, below);
        ExpectRest(scene, RestingTolerance(Vector3d::Zero()));
      }
    }
  }
}

// Plates and rods, thinner than the way of a substep, are thrown at each other at random: none
// comes through, and their momentum stays.
TEST_P(BodyStack, ThinThingsAreCaught) {
  std::mt19937 random(5);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int hit = 0; hit < 20; ++hit) {
    SCOPED_TRACE(hit);
    Scene scene = Nothing();
    scene.parameters.gravity_m_per_s2.setZero();
    const double speed = between(1, 20);
    Collider target = BoxAt(Vector3d::Zero(), {0.15, 0.001, 0.15});
    target.mass_kg = between(0.1, 5);
    const Quaterniond turned(
        AngleAxisd(between(0, 0.6), Vector3d(1, 0, between(-1, 1)).normalized()));
    Collider thrown =
        hit % 2 == 0 ? BoxAt({0, 0.15, 0}, {0.1, 0.001, 0.1}, turned)
                     : CapsuleBetween(turned * Vector3d(-0.1, 0, 0) + Vector3d(0, 0.15, 0),
                                      turned * Vector3d(0.1, 0, 0) + Vector3d(0, 0.15, 0), 0.001);
    thrown.mass_kg = 0.1;
    AddBody(scene, target);
    AddBody(scene, thrown, {0, -speed, 0});
    // Until it would be as far on the other side.
    StepFor(scene, 0.3 / speed);
    const RigidMotion& struck = report_.bodies->at(0).motion;
    const RigidMotion& end = report_.bodies->at(1).motion;
    EXPECT_GT((struck.rotation.conjugate() * (end.position_m - struck.position_m)).y(), 0);
    const Vector3d momentum = target.mass_kg * struck.velocity_m_per_s + 0.1 * end.velocity_m_per_s;
    EXPECT_LE((momentum - Vector3d(0, -0.1 * speed, 0)).norm(), 1e-13 * speed);
  }
}

}  // namespace
}  // namespace drape::test
