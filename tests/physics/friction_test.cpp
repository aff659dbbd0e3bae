// Coulomb friction of whole cloths that hold, slip and rest.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

// The farthest that any particle is from where it was.
double LargestWay(const ParticleState& now, const ParticleState& before) {
  double way = 0;
  for (size_t i = 0; i < now.positions_m.size(); ++i) {
    way = std::max(way, (now.positions_m[i] - before.positions_m[i]).norm());
  }
  return way;
}

class SheetFriction : public PresetTest {
 protected:
  // A sheet of 12 cm on a plane inclined about the z axis.
  Scene SheetOn(double angle, double friction_static, double friction_dynamic) {
    Scene scene = Grid(5, 5, 0.12, 0.12);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
    for (Vector3d& p : scene.state.positions_m) p = turn * (p - Vector3d(0.06, 0, 0.06));
    scene.parameters.colliders = {PlaneThrough({0, 0, 0}, turn * Vector3d::UnitY())};
    scene.parameters.friction_static = friction_static;
    scene.parameters.friction_dynamic = friction_dynamic;
    scene.parameters.settings = PresetSettings(preset());
    return scene;
  }
};

// The requirement: a block that sticks creeps less than 0.1 mm in 10 s. tan(20 degrees) = 0.364.
TEST_P(SheetFriction, ASheetThatSticksDoesNotCreep) {
  const Scene scene = SheetOn(20 * M_PI / 180, 0.4, 0.3);
  const ClothHandle cloth = Make(scene);
  const ParticleState start = ReadState(backend(), cloth);
  StepAlone(backend(), cloth, scene, 600);
  const double creep = LargestWay(ReadState(backend(), cloth), start);
  std::printf("[ MEASURED ] creep of a sticking sheet in 10 s, %s on %s: %.3g mm\n",
              std::string(PresetName(preset())).c_str(), backend_name().c_str(), 1e3 * creep);
  EXPECT_LE(creep, 1e-4);
}

// One degree beyond atan(0.4) = 21.8 degrees it slides, all of it as one block, with the dynamic
// coefficient: constant acceleration has no discretisation error. Rounding: as for a particle
// (contact_test) some 12 of gravity's own g h and of the speed per substep, g t in all; the links
// hand on what differs.
TEST_P(SheetFriction, ASheetSlidesWithTheDynamicCoefficient) {
  const double angle = 22.8 * M_PI / 180;
  const Scene scene = SheetOn(angle, 0.4, 0.3);
  const ClothHandle cloth = Make(scene);
  const ParticleState start = ReadState(backend(), cloth);
  constexpr uint32_t kSteps = 30;
  StepAlone(backend(), cloth, scene, kSteps);
  const ParticleState state = ReadState(backend(), cloth);
  const double time = kSteps * scene.parameters.settings.time_step_s;
  const double acceleration = kG * (std::sin(angle) - 0.3 * std::cos(angle));
  const Vector3d downhill(std::cos(angle), -std::sin(angle), 0);
  const double roundings = kSteps * scene.parameters.settings.substeps * 12 + 4;
  const double bound = roundings * round_off() * kG * time;
  // With two steps, what is slower than SlipSpeed feels the static friction until
  // `correct_velocity` finds that nothing holds: its velocity is right then, its way too short by
  // that of a substep.
  const double h = scene.parameters.settings.substep_s();
  const double pressed = kG * std::cos(angle);
  const double slow_s = kSlipSubsteps * 0.4 * h * kG / acceleration;
  const double late = preset() == Preset::kPaper ? 0 : (0.4 - 0.3) * pressed * h * slow_s;
  for (size_t i = 0; i < state.positions_m.size(); ++i) {
    const Vector3d way = state.positions_m[i] - start.positions_m[i];
    const double expected = acceleration * time * time / 2;
    EXPECT_LE(way.dot(downhill), expected + bound) << "particle " << i;
    EXPECT_GE(way.dot(downhill), expected - late - bound) << "particle " << i;
    EXPECT_NEAR(state.velocities_m_per_s[i].dot(downhill), acceleration * time, bound);
  }
}

// A sheet at rest on a plane stays where it is: once it lies, friction leaves a particle a
// tangential velocity of rounding size, h times which vanishes beside its position.
void ExpectRest(Backend& backend, ClothHandle cloth, const Scene& scene, uint32_t steps) {
  StepAlone(backend, cloth, scene, 60);
  const ParticleState settled = ReadState(backend, cloth);
  StepAlone(backend, cloth, scene, steps);
  const ParticleState later = ReadState(backend, cloth);
  const double round_off = UnitRoundOff(backend);
  EXPECT_LE(LargestWay(later, settled), 4 * 0.65 * round_off);
  double speed = 0;
  for (const Vector3d& v : later.velocities_m_per_s) speed = std::max(speed, v.norm());
  EXPECT_LE(speed, kG * scene.parameters.settings.substep_s() * 8 * round_off);
}

TEST_P(SheetFriction, AtRestOnAPlane) {
  Scene scene = SheetOn(0, 0.4, 0.3);
  for (Vector3d& p : scene.state.positions_m) p.y() -= 0.65;
  scene.parameters.colliders = {PlaneThrough(Vector3d(0, -0.65, 0), {0, 1, 0})};
  const ClothHandle cloth = Make(scene);
  ExpectRest(backend(), cloth, scene, 1000);
}

class SheetFrictionLong : public SheetFriction {};

// The requirement: no drift in 10^5 steps.
TEST_P(SheetFrictionLong, AtRestOnAPlaneFor100000Steps) {
  Scene scene = SheetOn(0, 0.4, 0.3);
  for (Vector3d& p : scene.state.positions_m) p.y() -= 0.65;
  scene.parameters.colliders = {PlaneThrough(Vector3d(0, -0.65, 0), {0, 1, 0})};
  const ClothHandle cloth = Make(scene);
  ExpectRest(backend(), cloth, scene, 100'000);
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(SheetFriction);
DRAPE_PRESET_TEST_ON_EVERY_BACKEND(SheetFrictionLong);

// A sheet on a slope of 0.5 rad, above it by `drop_m`, whose friction is far smaller once it
// slides.
class Slope : public PhysicsTest {
 protected:
  static constexpr double kAngle = 0.5;
  static constexpr double kDynamic = 0.5;  // of tan kAngle

  // How far its first particle moves in a second. `friction_static` in terms of tan kAngle.
  double Motion(double friction_static, double drop_m) {
    Scene scene = Grid(8, 8, 0.5, 0.5);
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.settings.time_step_s = 1.0 / 60;
    const Vector3d up(std::sin(kAngle), std::cos(kAngle), 0);
    scene.parameters.colliders = {PlaneThrough(Vector3d::Zero(), up)};
    scene.parameters.friction_static = friction_static * std::tan(kAngle);
    scene.parameters.friction_dynamic = kDynamic * std::tan(kAngle);
    for (Vector3d& p : scene.state.positions_m) {
      p = p.x() * Vector3d(std::cos(kAngle), -std::sin(kAngle), 0) + Vector3d(0, 0, p.z()) +
          drop_m * up;
    }
    return (StateAfter(scene, 60).positions_m.front() - scene.state.positions_m.front()).norm();
  }
};

// It falls straight down and stays where it lands.
TEST_P(Slope, HoldsJustBelowItsStaticFrictionHoweverItLands) {
  for (const double drop_m : {0.0, 0.0005, 0.002, 0.02}) {
    EXPECT_NEAR(Motion(1.02, drop_m), drop_m / std::cos(kAngle), 1e-4) << "from " << drop_m << " m";
  }
}

TEST_P(Slope, SlidesJustAboveItsStaticFriction) {
  const double acceleration = kG * std::sin(kAngle) * (1 - kDynamic);
  EXPECT_NEAR(Motion(0.98, 0) / (acceleration / 2), 1, 1e-3);
}

// Any slope: its angle and direction, where its point is, what lies on it and how.
struct AnySlope {
  double angle = 0;       // [rad]
  double direction = 0;   // of the downhill line, about y [rad]
  double turn = 0;        // of the cloth on the slope [rad]
  double distance_m = 0;  // of the plane's point from the cloth
  double drop_m = 0;      // start above the slope
  double away_m = 0;      // of the cloth from the origin, along the slope
  double dynamic = 0;     // of the static coefficient
  double time_step_s = 1.0 / 60;

  Eigen::Quaterniond rotation() const {
    const Vector3d up(std::sin(angle) * std::cos(direction), std::cos(angle),
                      std::sin(angle) * std::sin(direction));
    return Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitY(), up) *
           Eigen::Quaterniond(Eigen::AngleAxisd(turn, Vector3d::UnitY()));
  }
};

std::vector<AnySlope> RandomSlopes(uint32_t seed, uint32_t count) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<AnySlope> slopes;
  for (uint32_t k = 0; k < count; ++k) {
    slopes.push_back({.angle = between(0.1, 0.7),
                      .direction = between(0, 2 * std::numbers::pi),
                      .turn = between(0, 2 * std::numbers::pi),
                      .distance_m = between(0, 100),
                      .drop_m = k % 3 == 0 ? 0 : between(0, 0.01),
                      .dynamic = between(0, 0.9),
                      .time_step_s = k % 4 == 3 ? 1.0 / 30 : 1.0 / 60});
  }
  return slopes;
}

// Triangles whose corners are `jitter` of an edge off those of a square grid, 0.7 m wide.
Scene IrregularMesh(uint32_t side, double jitter) {
  std::mt19937 random(4);
  const double edge_m = 0.7 / (side - 1);
  std::uniform_real_distribution<double> off_m(-jitter * edge_m, jitter * edge_m);
  ParticleTopology mesh;
  for (uint32_t k = 0; k < side * side; ++k) {
    mesh.positions_m.emplace_back(edge_m * (k % side) + off_m(random), 0,
                                  edge_m * (k / side) + off_m(random));
  }
  mesh.masses_kg.assign(mesh.positions_m.size(), 0.005);
  const auto link = [&](uint32_t i, uint32_t j) {
    const double length_m = (mesh.positions_m[i] - mesh.positions_m[j]).norm();
    mesh.distance_constraints.push_back({.i = i, .j = j, .rest_length_m = length_m});
  };
  for (uint32_t k = 0; k < side * side; ++k) {
    const bool has_right = (k + 1) % side != 0, has_next = k + side < side * side;
    if (has_right) link(k, k + 1);
    if (has_next) link(k, k + side);
    if (has_right && has_next) link(k, k + side + 1);
  }
  return Particles(mesh);
}

Scene SingleParticles() {
  ParticleTopology particles;
  for (uint32_t k = 0; k < 5; ++k) {
    particles.positions_m.emplace_back(0.2 * k, 0, 0.1 * k * k);
    particles.masses_kg.push_back(0.01 * (k + 1));
  }
  return Particles(particles);
}

class AnySlopes : public PresetTest {
 protected:
  // The mean way of the scene's particles, that straight down to the slope left out, in a second.
  double Way(Scene scene, const AnySlope& slope, double friction_static) {
    scene.parameters.settings = PresetSettings(preset());
    scene.parameters.settings.time_step_s = slope.time_step_s;
    const Eigen::Quaterniond rotation = slope.rotation();
    const Vector3d up = rotation * Vector3d::UnitY();
    const Vector3d aside = rotation * Vector3d(0.8, 0, 0.6);
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& p : scene.state.positions_m) centre += p;
    centre /= static_cast<double>(scene.state.positions_m.size());
    for (Vector3d& p : scene.state.positions_m)
      p = rotation * (p - centre) + slope.drop_m * up + slope.away_m * aside;
    scene.parameters.colliders = {PlaneThrough(slope.distance_m * aside, up)};
    scene.parameters.friction_static = friction_static * std::tan(slope.angle);
    scene.parameters.friction_dynamic = slope.dynamic * scene.parameters.friction_static;
    const auto steps = static_cast<uint32_t>(std::lround(1 / slope.time_step_s));
    const Vector3d fall = slope.drop_m / up.y() * -Vector3d::UnitY();
    const ParticleState end = StateAfter(scene, steps);
    double way = 0;
    for (size_t i = 0; i < end.positions_m.size(); ++i) {
      way += (end.positions_m[i] - scene.state.positions_m[i] - fall).norm();
    }
    return way / static_cast<double>(end.positions_m.size());
  }

  // What lands is held from the next substep on: in the substep before it falls for at most h with
  // its speed.
  double LandingWay(const AnySlope& slope) const {
    const double h = slope.time_step_s / PresetSettings(preset()).substeps;
    return std::sqrt(2 * kG * slope.drop_m) * h;
  }

  // How far it moves at most in a second 2 % below its limit [m].
  double HeldWay(const AnySlope& slope) const { return 1e-4 + LandingWay(slope); }

  // 2 % above its limit: by how much its way is off the closed form, over that of a free slide.
  double SlideError(const Scene& scene, const AnySlope& slope) {
    const double free = kG * std::sin(slope.angle);
    const double acceleration = free * (1 - 0.98 * slope.dynamic);
    return (Way(scene, slope, 0.98) - acceleration / 2) / (free / 2);
  }

  // The requirement, 0.1 %, of the forces that nearly balance.
  static constexpr double kSlideTolerance = 1e-3;

  static const std::vector<std::pair<std::string, Scene>>& Scenes() {
    static const std::vector<std::pair<std::string, Scene>> scenes = {
        {"grid", Grid(9, 7, 0.6, 0.5)},
        {"mesh", IrregularMesh(8, 0.25)},
        {"single particles", SingleParticles()}};
    return scenes;
  }
};

TEST_P(AnySlopes, HoldWhatIsBelowItsLimitAndLetSlideWhatIsAbove) {
  for (const AnySlope& slope : RandomSlopes(20, 6)) {
    for (const auto& [name, scene] : Scenes()) {
      SCOPED_TRACE(name + ", angle " + std::to_string(slope.angle) + ", drop " +
                   std::to_string(slope.drop_m));
      EXPECT_LE(Way(scene, slope, 1.02), HeldWay(slope)) << "2 % below its limit";
      if (slope.drop_m > 0) continue;
      EXPECT_NEAR(SlideError(scene, slope), 0, kSlideTolerance) << "2 % above it";
    }
  }
}

class AnySlopesLong : public AnySlopes {};

// Some metres from the origin of the cloth's frame rounding lets some go, and holds others for a
// moment: told, and bounded at the origin alone, where about one of a thousand slides that lands in
// two substeps (method.md, «Known and accepted»).
TEST_P(AnySlopesLong, NearTheOriginAndAway) {
  for (const double away_m : {0.0, 3.0, 20.0}) {
    uint32_t count = 0, let_go = 0, slide_count = 0, held_up = 0;
    for (AnySlope slope : RandomSlopes(77, 60)) {
      slope.away_m = away_m;
      for (const auto& [name, scene] : Scenes()) {
        ++count;
        let_go += Way(scene, slope, 1.02) > HeldWay(slope) ? 1 : 0;
        if (slope.drop_m > 0) continue;
        ++slide_count;
        held_up += std::abs(SlideError(scene, slope)) > kSlideTolerance ? 1 : 0;
      }
    }
    std::printf(
        "[ MEASURED ] slopes, %s on %s, %.0f m from the origin: 2 %% below the limit %u of %u "
        "slide, 2 %% above it %u of %u are off by more than 0.1 %%\n",
        std::string(PresetName(preset())).c_str(), backend_name().c_str(), away_m, let_go, count,
        held_up, slide_count);
    if (away_m > 0 && backend_name() != "reference") continue;
    EXPECT_LE(let_go, 1u);
    EXPECT_EQ(held_up, 0u);
  }
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(AnySlopes);
DRAPE_PRESET_TEST_ON_EVERY_BACKEND(AnySlopesLong);

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Slope);

}  // namespace
}  // namespace drape::test
