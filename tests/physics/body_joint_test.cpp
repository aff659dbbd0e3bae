// Point joints of bodies: pendulums, linkages and chains against closed forms, integrated equations
// and what must stay (server/solver/bodies/body_joints.h).
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "tests/physics/body_joints.h"

namespace drape::test {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr double kG = 9.81;

class BodyJoints : public BodyTest {};
INSTANTIATE_TEST_SUITE_P(Backends, BodyJoints, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// A rod of 1.5 kg between two points, as thick as `half_m`.
Collider Rod(const Vector3d& a_m, const Vector3d& b_m, double half_m = 0.02) {
  const double length_m = (b_m - a_m).norm();
  Collider rod = BoxAt((a_m + b_m) / 2, {length_m / 2, half_m, 1.5 * half_m},
                       Quaterniond::FromTwoVectors(Vector3d::UnitX(), b_m - a_m));
  rod.mass_kg = 1.5;
  return rod;
}

// theta'' = -omega^2 sin(theta), from rest, by Runge and Kutta's method.
double PendulumAngle(double omega_sq, double angle, double seconds) {
  constexpr int kSteps = 200'000;
  const double h = seconds / kSteps;
  double rate = 0;
  const auto pull = [&](double at) { return -omega_sq * std::sin(at); };
  for (int k = 0; k < kSteps; ++k) {
    const double a1 = rate, b1 = pull(angle);
    const double a2 = rate + h / 2 * b1, b2 = pull(angle + h / 2 * a1);
    const double a3 = rate + h / 2 * b2, b3 = pull(angle + h / 2 * a2);
    const double a4 = rate + h * b3, b4 = pull(angle + h * a3);
    angle += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    rate += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4);
  }
  return angle;
}

// A rod that swings from the horizontal. The scheme is that of Verlet for the angle: its frequency
// is off by (omega h)^2/24 for small swings, for large ones by a few times that; so many radians
// per radian that it goes.
TEST_P(BodyJoints, ACompoundPendulumSwingsAsItsEquation) {
  for (const uint32_t substeps : {26u, 52u, 104u}) {
    Scene scene = Nothing();
    scene.parameters.settings.substeps = substeps;
    const Collider rod = Rod({0, 0, 0}, {0.6, 0, 0});
    const double inertia = MassOf(rod).inertia(2, 2) + 1.5 * 0.3 * 0.3;
    const double omega_sq = 1.5 * kG * 0.3 / inertia;
    AddBody(scene, rod);
    Hinge(scene, 0, {0, 0, 0}, Vector3d::UnitZ());
    const ClothHandle cloth = Make(scene);
    RigidMotion motion;
    constexpr int kSteps = 300;
    double most_off = 0;
    const double energy = EnergyAtStart(scene);
    for (int step = 0; step < kSteps; ++step) {
      motion = Step(cloth, scene);
      most_off = std::max(most_off, std::abs(EnergyOfBodies(scene, report_) - energy));
      ASSERT_LE(OpenOf(scene, report_), 1e-13);
    }
    const double angle = PendulumAngle(omega_sq, M_PI / 2, kSteps / 60.0);
    const double its = std::atan2(motion.position_m.x(), -motion.position_m.y());
    const double omega_h_sq = omega_sq * std::pow(scene.parameters.settings.substep_s(), 2);
    const double way = 2 * std::sqrt(omega_sq) * kSteps / 60.0;  // no faster than 2 omega
    std::printf("[ MEASURED ] %s, %u substeps: angle off by %.3g, energy by %.3g of M g d\n",
                backend_name().c_str(), substeps, its - angle, most_off / (1.5 * kG * 0.3));
    EXPECT_NEAR(its, angle, way * omega_h_sq / 6);
    // The energy of Verlet's scheme swings by (omega h)^2/8 of that of small swings.
    EXPECT_LE(most_off, omega_h_sq * 1.5 * kG * 0.3);
  }
}

// Two rods that hang by each other, from 60 and 20 degrees, against Lagrange's equations for the
// angles. Their motion is not chaotic within that time.
TEST_P(BodyJoints, ADoublePendulumSwingsAsItsEquations) {
  static constexpr double kLength = 0.5, kMass = 1.5;
  const auto place = [](double angle) -> Vector3d {
    return kLength * Vector3d(std::sin(angle), -std::cos(angle), 0);
  };
  std::array<double, 4> x{M_PI / 3, M_PI / 9, 0, 0};
  Scene scene = Nothing();
  const Vector3d elbow = place(x[0]);
  AddBody(scene, Rod(Vector3d::Zero(), elbow));
  AddBody(scene, Rod(elbow, elbow + place(x[1])));
  const double inertia = MassOf(Rod({0, 0, 0}, {kLength, 0, 0})).inertia(2, 2);
  Join(scene, 0, Vector3d::Zero());
  Join(scene, 1, elbow, 0);
  const auto slope = [&](const std::array<double, 4>& at) {
    const double d = at[0] - at[1];
    const double a = inertia + kMass * 1.25 * kLength * kLength;
    const double b = kMass * kLength * kLength / 2 * std::cos(d);
    const double c = inertia + kMass * kLength * kLength / 4;
    const double coupling = kMass * kLength * kLength / 2 * std::sin(d);
    const double e = -coupling * at[3] * at[3] - 1.5 * kMass * kG * kLength * std::sin(at[0]);
    const double f = coupling * at[2] * at[2] - 0.5 * kMass * kG * kLength * std::sin(at[1]);
    const double det = a * c - b * b;
    return std::array<double, 4>{at[2], at[3], (c * e - b * f) / det, (a * f - b * e) / det};
  };
  constexpr int kParts = 2000;
  const auto advance = [&](double h) {
    const auto from = x;
    const auto moved = [&](const std::array<double, 4>& by, double share) {
      std::array<double, 4> to = from;
      for (size_t k = 0; k < 4; ++k) to[k] += share * h * by[k];
      return to;
    };
    const auto s1 = slope(from), s2 = slope(moved(s1, 0.5)), s3 = slope(moved(s2, 0.5)),
               s4 = slope(moved(s3, 1));
    for (size_t k = 0; k < 4; ++k) x[k] += h / 6 * (s1[k] + 2 * s2[k] + 2 * s3[k] + s4[k]);
  };
  const ClothHandle cloth = Make(scene);
  double most_off = 0;
  for (int step = 0; step < 120; ++step) {
    Step(cloth, scene);
    for (int part = 0; part < kParts / 10; ++part) advance(1.0 / 60 / (kParts / 10));
    const Vector3d first = report_.bodies->at(0).motion.position_m;
    most_off = std::max(most_off, (first - place(x[0]) / 2).norm());
    const Vector3d second = report_.bodies->at(1).motion.position_m;
    most_off = std::max(most_off, (second - place(x[0]) - place(x[1]) / 2).norm());
    ASSERT_LE(OpenOf(scene, report_), 1e-13);
  }
  // Its faster mode has omega^2 = 2.3 times 3/2 g/l times about 2.
  const double omega_h_sq = 7 * kG / kLength * std::pow(scene.parameters.settings.substep_s(), 2);
  const double way = 2 * std::sqrt(7 * kG / kLength) * 2 * kLength;
  std::printf("[ MEASURED ] %s: a double pendulum is off by %.3g m\n", backend_name().c_str(),
              most_off);
  EXPECT_LE(most_off, way * omega_h_sq);
}

// A parallel four-bar and Bricard's linkage: closed chains whose hinges say more than they must.
// The linkages move, their hinges stay closed, and their energy stays.
struct Linkage {
  std::vector<Vector3d> corners;  // the last rod, back to the first corner, is the environment
  std::vector<Vector3d> axes;     // of the hinge at each corner
};

TEST_P(BodyJoints, ClosedLinkagesKeepTheirEnergy) {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  const std::array linkages{
      Linkage{{{0, 0, 0}, {0.3, 0.4, 0}, {1.1, 0.5, 0}, {0.9, 0, 0}}, {z, z, z, z}},
      Linkage{{{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}},
              {y, z, x, y, z, x}}};
  for (const Linkage& linkage : linkages) {
    Scene scene = Nothing();
    const size_t rods = linkage.corners.size() - 1;
    for (size_t k = 0; k < rods; ++k) {
      AddBody(scene, Rod(linkage.corners[k], linkage.corners[k + 1]));
    }
    Hinge(scene, 0, linkage.corners[0], linkage.axes[0]);
    for (uint32_t k = 1; k < rods; ++k) {
      Hinge(scene, k, linkage.corners[k], linkage.axes[k], k - 1);
    }
    Hinge(scene, static_cast<uint32_t>(rods - 1), linkage.corners[rods], linkage.axes[rods]);
    const ClothHandle cloth = Make(scene);
    const double energy = EnergyAtStart(scene);
    double most_off = 0, most_open = 0, most_kinetic = 0;
    for (int step = 0; step < 300; ++step) {
      Step(cloth, scene);
      most_off = std::max(most_off, std::abs(EnergyOfBodies(scene, report_) - energy));
      most_kinetic = std::max(most_kinetic, KineticOfBodies(scene, report_));
      most_open = std::max(most_open, OpenOf(scene, report_));
    }
    std::printf("[ MEASURED ] %s, %zu rods: energy off by %.3g of %.3g J, open by %.3g m\n",
                backend_name().c_str(), rods, most_off, most_kinetic, most_open);
    EXPECT_GT(most_kinetic, 1);
    // The scheme is of second order; nothing here turns faster than 20 rad/s.
    const double turn = 20 * scene.parameters.settings.substep_s();
    EXPECT_LE(most_off, turn * turn * most_kinetic);
    EXPECT_LE(most_open, 1e-12);
  }
}

// Two bricks that hang together and nothing else: momentum and angular momentum stay to rounding,
// energy to the order of the scheme.
TEST_P(BodyJoints, AFreePairKeepsItsMomenta) {
  Scene scene = Nothing();
  scene.parameters.gravity_m_per_s2.setZero();
  Collider first = BoxAt({0, 0, 0}, {0.1, 0.2, 0.15}),
           second = BoxAt({0.3, 0.1, 0}, {0.1, 0.1, 0.2});
  first.mass_kg = 2;
  second.mass_kg = 0.5;
  const Vector3d joint(0.15, 0.1, 0.05);
  AddBody(scene, first, {1, 2, -1}, {3, -2, 5});
  // Moving as the joint does, and spinning otherwise.
  const Vector3d rate(-4, 1, 2);
  const Vector3d of_joint = Vector3d(1, 2, -1) + Vector3d(3, -2, 5).cross(joint);
  AddBody(scene, second, of_joint + rate.cross(Vector3d(0.3, 0.1, 0) - joint), rate);
  Join(scene, 1, joint, 0);
  const ClothHandle cloth = Make(scene);
  const BodyMomenta before = MomentaOfBodies(scene, ReportAtStart(scene));
  const double energy = EnergyAtStart(scene);
  double most_off = 0, most_gain = 0;
  for (int step = 0; step < 300; ++step) {
    Step(cloth, scene);
    const BodyMomenta now = MomentaOfBodies(scene, report_);
    // About the origin, from which the pair moves away.
    const double size = before.angular.norm() + before.linear.norm() * (1 + 3 * step / 60.0);
    const double off = std::max((now.linear - before.linear).norm() / before.linear.norm(),
                                (now.angular - before.angular).norm() / size);
    most_off = std::max(most_off, off);
    ASSERT_LE(off, 60 * (step + 1) * 1e-15) << step;
    most_gain = std::max(most_gain, std::abs(EnergyOfBodies(scene, report_) / energy - 1));
  }
  std::printf("[ MEASURED ] %s: momenta off by %.3g, energy by %.3g\n", backend_name().c_str(),
              most_off, most_gain);
  const double turn = 10 * scene.parameters.settings.substep_s();
  EXPECT_LE(most_gain, turn * turn);
}

// Two halves of a brick that three joints fix to each other are the brick.
TEST_P(BodyJoints, HalvesThatAreFixedTumbleAsTheWhole) {
  const Vector3d rate(5, 0.1, 0.2), velocity(0.5, 3, 0);
  Scene whole = Nothing(), halves = Nothing();
  Collider brick = BoxAt({0, 0, 0}, {0.2, 0.1, 0.05});
  brick.mass_kg = 2;
  AddBody(whole, brick, velocity, rate);
  for (const double side : {-1.0, 1.0}) {
    const Vector3d centre(0.1 * side, 0, 0);
    Collider half = BoxAt(centre, {0.1, 0.1, 0.05});
    half.mass_kg = 1;
    AddBody(halves, half, velocity + rate.cross(centre), rate);
  }
  for (const Vector3d& point :
       {Vector3d(0, 0.1, 0), Vector3d(0, -0.1, 0.05), Vector3d(0, 0, -0.05)}) {
    Join(halves, 1, point, 0);
  }
  const RigidMotion of_whole = StepFor(whole, 2), of_half = StepFor(halves, 2);
  const double turned = of_whole.rotation.angularDistance(of_half.rotation);
  const double off = (of_half.PlaceOf(Vector3d::Zero()) - of_whole.position_m).norm();
  std::printf("[ MEASURED ] %s: halves are turned by %.3g and off by %.3g m\n",
              backend_name().c_str(), turned, off);
  // Half the square of the turn in a substep, in each of them at most, is what schemes of second
  // order may lose.
  const double turn = 5 * halves.parameters.settings.substep_s();
  EXPECT_LE(turned, turn * turn * 10);
  EXPECT_LE(off, turn * turn * 10 * 0.2);
}

// Six links of 1 g and a ball of 1 kg at their end, from the horizontal down and up again, three
// quarters of a second: they hold to rounding.
TEST_P(BodyJoints, AChainOfLightLinksCarriesAHeavyBall) {
  Scene scene = Nothing();
  constexpr uint32_t kLinks = 6;
  const auto node = [](uint32_t k) { return Vector3d(0.05 * k, 0, 0); };
  for (uint32_t k = 0; k < kLinks; ++k) {
    Collider link = CapsuleBetween(node(k), node(k + 1), 0.002);
    link.mass_kg = 1e-3;
    AddBody(scene, link);
    Join(scene, k, node(k), k == 0 ? std::nullopt : std::optional(k - 1));
  }
  AddBody(scene, Ball(node(kLinks) + Vector3d(0.03, 0, 0), 0.03, 1));
  Join(scene, kLinks, node(kLinks), kLinks - 1);
  const ClothHandle cloth = Make(scene);
  const double energy = EnergyAtStart(scene);
  for (int step = 0; step < 40; ++step) {
    Step(cloth, scene);
    // Of M g l, to second order in the fastest swing of a light link: (k/m)^(1/2) h = 0.3 with
    // k = 4 * 30 N/0.05 m, of which next to nothing is there.
    ASSERT_NEAR(EnergyOfBodies(scene, report_), energy, 1e-4 * kG * 0.33) << step;
    ASSERT_LE(OpenOf(scene, report_), 1e-13) << step;
  }
}

// A ball on an arm that is no body and turns: it stays at its point.
TEST_P(BodyJoints, AKinematicColliderCarriesWhatHangsOnIt) {
  Scene scene = Nothing();
  AddBody(scene, BoxAt({0, 0, 0}, {0.5, 0.02, 0.02}), {0.3, 0, 0}, {0, 2, 0});
  Collider pendulum = Rod({0.5, 0, 0}, {0.5, -0.4, 0});
  AddBody(scene, pendulum, {0.3, 0, -1}, {0, 0, 0});
  Join(scene, 1, {0.5, 0, 0}, 0);
  const ClothHandle cloth = Make(scene);
  Vector3d given = Vector3d::Zero();
  RigidMotion before = scene.parameters.collider_motions[1];
  for (int step = 1; step <= 120; ++step) {
    const RigidMotion now = Step(cloth, scene);
    const RigidMotion arm = scene.parameters.collider_motions[0].After(step / 60.0);
    ASSERT_LE((now.PlaceOf({0.5, 0, 0}) - arm.PlaceOf({0.5, 0, 0})).norm(), 1e-13);
    // What the arm feels is what the rod does not get from its weight.
    const Vector3d change = 1.5 * (now.velocity_m_per_s - before.velocity_m_per_s);
    const Vector3d weight = 1.5 / 60 * Vector3d(0, -kG, 0);
    ASSERT_LE((change - weight + report_.impulses->colliders[0].impulse_n_s).norm(), 1e-12);
    given += report_.impulses->colliders[0].impulse_n_s;
    before = now;
  }
  EXPECT_GT(given.norm(), 1);
}

// A plank that is hinged at one end and lies on the floor with the other: each carries half.
TEST_P(BodyJoints, AHingeAndTheFloorCarryHalfEach) {
  Scene scene = Nothing();
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  AddBody(scene, BoxAt({-0.1, 0.02, 0}, {0.05, 0.02, 0.02}));
  AddBody(scene, Rod({0, 0.02, 0}, {1, 0.02, 0}));
  AddBody(scene, BoxAt({1, -0.05, 0}, {0.01, 0.05, 0.2}));
  Hinge(scene, 1, {0, 0.02, 0}, Vector3d::UnitZ(), 0);
  const ClothHandle cloth = Make(scene);
  for (int step = 0; step < 60; ++step) Step(cloth, scene);
  const double weight = 1.5 * kG / 60;
  // The edge of the floor carries it 0.99 m from the hinge or a little farther.
  EXPECT_NEAR(-report_.impulses->colliders[2].impulse_n_s.y() / weight, 0.5, 0.01);
  EXPECT_NEAR(
      -(report_.impulses->colliders[0].impulse_n_s + report_.impulses->colliders[2].impulse_n_s)
              .y() /
          weight,
      1, 1e-9);
  // A contact may be off by 1e-10 of the body's size, which a substep takes back.
  EXPECT_LT(report_.bodies->at(0).motion.velocity_m_per_s.norm(),
            1e-10 / scene.parameters.settings.substep_s());
}

// Trees and rings of random solids that fall on a floor: joints stay closed and nothing gains
// energy, whatever hits what.
class RandomLinkages : public BodyTest {
 protected:
  void Fall(uint32_t seed, uint32_t solids, int steps) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> between(-1, 1);
    const auto vector = [&]() -> Vector3d {
      return {between(random), between(random), between(random)};
    };
    Scene scene = Nothing();
    scene.parameters.friction_static = 0.6;
    scene.parameters.friction_dynamic = 0.4;
    scene.parameters.restitution = seed % 2 == 0 ? 0.5 : 0;
    std::vector<Vector3d> centres;
    for (uint32_t k = 0; k < solids; ++k) {
      const Vector3d centre = Vector3d(0, 2, 0) + 0.8 * vector();
      Collider solid = k % 3 == 0 ? Ball(centre, 0.1, 1) : BoxAt(centre, {0.08, 0.05, 0.12});
      solid.mass_kg = std::pow(10, 1.5 * between(random));
      AddBody(scene, solid, Vector3d::Zero(), k == 0 ? Vector3d(0, 0, 0) : Vector3d::Zero());
      centres.push_back(centre);
      if (k == 0) continue;
      const auto other = static_cast<uint32_t>(random() % k);
      Join(scene, k, (centre + centres[other]) / 2, other);
    }
    Join(scene, solids - 1, (centres[solids - 1] + centres[0]) / 2, 0);
    AddBody(scene, PlaneThrough(Vector3d::Zero(), Vector3d(0.1, 1, 0.05).normalized()));
    const ClothHandle cloth = Make(scene);
    double energy = EnergyAtStart(scene);
    const double scale = energy;
    double most_gain = 0, most_open = 0;
    for (int step = 0; step < steps; ++step) {
      Step(cloth, scene);
      const double now = EnergyOfBodies(scene, report_);
      most_gain = std::max(most_gain, (now - energy) / scale);
      energy = std::min(energy, now);
      most_open = std::max(most_open, OpenOf(scene, report_));
    }
    std::printf("[ MEASURED ] %s, linkage %u: gains %.3g of its energy, opens by %.3g m\n",
                backend_name().c_str(), seed, most_gain, most_open);
    EXPECT_LE(most_gain, 1e-3);
    EXPECT_LE(most_open, 1e-12);
  }
};
class RandomLinkagesLong : public RandomLinkages {};

// Links of 1 to 30 g and 3 to 7 cm, any way, some on short ropes, and a ball of 1 to 10 kg that
// snaps them taut: they whip, by radians in a substep, and hit each other. Joints hold to rounding
// all the same, and nothing is gained. Impulses that act where a substep starts, alone, throw the
// ball.
class RandomChains : public BodyTest {
 protected:
  void Catch(uint32_t seed, int trials) {
    std::mt19937 random(seed);
    const auto any = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    double most_gain = 0, most_open = 0;
    for (int trial = 0; trial < trials; ++trial) {
      Scene scene = Nothing();
      Vector3d node = Vector3d::Zero(), way;
      const auto links = static_cast<uint32_t>(3 + random() % 5);
      for (uint32_t k = 0; k < links; ++k) {
        const bool is_on_rope = k > 0 && random() % 4 == 0;
        if (is_on_rope) node.x() += 0.01;
        way = any(0.03, 0.07) * Vector3d(any(0.2, 1), any(-1, 1), any(-0.5, 0.5)).normalized();
        Collider link = CapsuleBetween(node, node + way, 0.002);
        link.mass_kg = 1e-3 * std::exp(any(0, 3.4));
        AddBody(scene, link);
        if (is_on_rope) {
          HangOnRope(scene, k, node, node - Vector3d(0.01, 0, 0), 0.015, k - 1);
        } else {
          Join(scene, k, node, k == 0 ? std::nullopt : std::optional(k - 1));
        }
        node += way;
      }
      const double ball_kg = std::exp(any(0, 2.3));
      AddBody(scene, Ball(node + 0.03 * way.normalized(), 0.03, ball_kg));
      Join(scene, links, node, links - 1);
      const ClothHandle cloth = Make(scene);
      const double energy = EnergyAtStart(scene), size = ball_kg * kG * 0.05 * links;
      for (int step = 0; step < 60; ++step) {
        Step(cloth, scene);
        const double gain = EnergyOfBodies(scene, report_) - energy;
        most_gain = std::max(most_gain, gain / size);
        most_open = std::max(most_open, OpenOf(scene, report_));
      }
    }
    std::printf("[ MEASURED ] %s: %d chains gain %.3g of m g l, open by %.3g m\n",
                backend_name().c_str(), trials, most_gain, most_open);
    // A substep of free fall before they are taut: m g^2 h^2/2.
    const double substep_s = Nothing().parameters.settings.substep_s();
    EXPECT_LE(most_gain, kG * substep_s * substep_s / 2 / 0.15);
    EXPECT_LE(most_open, 1e-13);
  }
};
class RandomChainsLong : public RandomChains {};

TEST_P(RandomChains, CatchHeavyBalls) {
  Catch(5, 1);
}

TEST_P(RandomChainsLong, CatchHeavyBalls) {
  Catch(6, 60);
}

TEST_P(RandomLinkages, ThatHitTheFloorGainNothing) {
  for (const uint32_t seed : {1u, 2u}) Fall(seed, 4, 90);
}

TEST_P(RandomLinkagesLong, ThatHitTheFloorGainNothing) {
  for (const uint32_t seed : {3u, 4u, 5u, 6u}) Fall(seed, 8, 180);
}

INSTANTIATE_TEST_SUITE_P(Backends, RandomChains, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(Backends, RandomChainsLong, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(Backends, RandomLinkages, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(Backends, RandomLinkagesLong, testing::ValuesIn(OwnBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

}  // namespace
}  // namespace drape::test
