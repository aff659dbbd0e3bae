#include "tests/stability/atlas/atlas_scenes.h"

#include <cmath>
#include <functional>
#include <random>
#include <utility>

#include "server/solver/cloth_start.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kPinDistance_m = 0.9;
constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kSheetMass_kg = 0.2;  // 1 m^2 of 0.2 kg/m^2

// The angle between links of a polygon on a circle whose n links of 1/n span kPinDistance_m.
double ArcAngle_rad(uint32_t links) {
  double low = 1e-6, high = 2 * std::numbers::pi / links;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    const double chord = std::sin(links * middle / 2) / std::sin(middle / 2) / links;
    (chord > kPinDistance_m ? low : high) = middle;
  }
  return low;
}

// The same cloth made of particles and constraints, other masses, its state kept.
Scene WithMasses(const Scene& sheet, std::vector<double> masses_kg) {
  ParticleTopology particles;
  const auto rest = sheet.model->rest_positions_m();
  particles.positions_m.assign(rest.begin(), rest.end());
  particles.masses_kg = std::move(masses_kg);
  const auto constraints = sheet.model->constraints();
  particles.distance_constraints.assign(constraints.begin(), constraints.end());
  Scene scene = Particles(particles, {sheet.model->pins().begin(), sheet.model->pins().end()});
  scene.state = sheet.state;
  return scene;
}

Scene TautRow() {
  return Grid(21, 1, 1, 1, {0, 20});
}

// Both pins a quarter of a metre further out than the sheet reaches.
Scene PinsTooFarApart() {
  Scene scene = Grid(12, 12, 1, 1, {0, 11});
  scene.state.positions_m[0].x() -= 0.25;
  scene.state.positions_m[11].x() += 0.25;
  return scene;
}

// Corners of a cube and all 28 lengths between them, where 18 determine the shape.
Scene AllPairs() {
  ParticleTopology particles;
  for (uint32_t k = 0; k < 8; ++k) particles.positions_m.emplace_back(k & 1, (k >> 1) & 1, k >> 2);
  particles.masses_kg.assign(8, 0.1);
  for (uint32_t i = 0; i < 8; ++i) {
    for (uint32_t j = i + 1; j < 8; ++j) {
      const double length_m = (particles.positions_m[i] - particles.positions_m[j]).norm();
      particles.distance_constraints.push_back({i, j, length_m, 0});
    }
  }
  Scene scene = Particles(particles, {0});
  Stir(scene, 0.5);
  return scene;
}

// A hung sheet with both diagonals of every cell: nothing may shear.
Scene Braced() {
  constexpr uint32_t kSide = 8;
  const Scene sheet = Grid(kSide, kSide, 1, 1, {0, kSide - 1});
  ParticleTopology particles;
  particles.positions_m = sheet.state.positions_m;
  particles.masses_kg.assign(sheet.model->masses_kg().begin(), sheet.model->masses_kg().end());
  const auto constraints = sheet.model->constraints();
  particles.distance_constraints.assign(constraints.begin(), constraints.end());
  const double diagonal_m = std::sqrt(2.0) / (kSide - 1);
  for (uint32_t row = 0; row + 1 < kSide; ++row) {
    for (uint32_t column = 0; column + 1 < kSide; ++column) {
      const uint32_t i = row * kSide + column;
      particles.distance_constraints.push_back({i, i + kSide + 1, diagonal_m, 0});
      particles.distance_constraints.push_back({i + 1, i + kSide, diagonal_m, 0});
    }
  }
  return Particles(particles, {0, kSide - 1});
}

// Three lengths that make no triangle.
Scene ImpossibleTriangle() {
  return Particles({{{0, 0, 0}, {1, 0, 0}, {2, 0.1, 0}},
                    {0.1, 0.1, 0.1},
                    {{0, 1, 1, 0}, {1, 2, 1, 0}, {0, 2, 3, 0}},
                    {}},
                   {0});
}

// A rope of 1 m and a strut of 1.5 m between the same two particles.
Scene RopeAgainstStrut() {
  return Particles(
      {{{0, 0, 0}, {1.2, 0, 0}},
       {0.1, 0.1},
       {{0, 1, 1, 0, ConstraintKind::kAtMost}, {0, 1, 1.5, 0, ConstraintKind::kAtLeast}},
       {}},
      {0});
}

// A chain of 1 m whose ends are joined to pins at a distance of 1.5 m.
Scene JointsTooFarApart() {
  constexpr uint32_t kLinks = 10;
  ParticleTopology particles;
  for (uint32_t k = 0; k <= kLinks; ++k) {
    particles.positions_m.emplace_back(1.0 / kLinks * k, 0, 0);
    if (k > 0) particles.distance_constraints.push_back({k - 1, k, 1.0 / kLinks, 0});
  }
  particles.positions_m.emplace_back(-0.25, 0, 0);
  particles.positions_m.emplace_back(1.25, 0, 0);
  particles.masses_kg.assign(kLinks + 3, 0.01);
  particles.point_joints = {{0, kLinks + 1, 0}, {kLinks, kLinks + 2, 0}};
  return Particles(particles, {kLinks + 1, kLinks + 2});
}

// As the server starts cloths that are described so (SceneModel::start_positions_m,
// FindClearStart).
std::vector<NamedCase> Started(std::vector<NamedCase> described) {
  for (auto& [name, atlas_case] : described) {
    const LengthDemands demands = atlas_case.scene.model->length_demands();
    std::vector<Vector3d>& positions_m = atlas_case.scene.state.positions_m;
    if (NeedsRestoring(FindLengthErrors(demands, positions_m))) {
      RestoreLengths(demands, positions_m);
    }
    ClearStart start =
        FindClearStart(*atlas_case.scene.model, atlas_case.scene.parameters, positions_m);
    if (start.clearance != StartClearance::kCleared) continue;
    positions_m = std::move(start.positions_m);
    atlas_case.allowed_gain_j = 0;  // no contact pushes it out
  }
  return described;
}

constexpr uint32_t kStartSide = 12;

// The hung sheet with the position of every free particle changed.
AtlasCase ChangedStart(const std::function<Vector3d(const Vector3d&)>& change) {
  AtlasCase start{.scene = HungSheet(kStartSide)};
  for (uint32_t i = 0; i < start.scene.model->particle_count(); ++i) {
    Vector3d& p = start.scene.state.positions_m[i];
    if (start.scene.model->inverse_masses_per_kg()[i] > 0) p = change(p);
  }
  return start;
}

AtlasCase ZeroArea() {
  AtlasCase start{.scene = HungSheet(kStartSide)};
  const double link_m = 1.0 / (kStartSide - 1);
  for (uint32_t i = 0; i < kStartSide * kStartSide; ++i) {
    const uint32_t steps = i / kStartSide + i % kStartSide;
    start.scene.state.positions_m[i] = Vector3d(link_m * steps, 0, 0);
  }
  return start;
}

AtlasCase InsidePlane() {
  constexpr double kDepth_m = 0.25;
  AtlasCase start{.scene = Grid(kStartSide, kStartSide, 1, 1)};
  start.scene.parameters.colliders = {PlaneThrough({0, kDepth_m, 0}, Vector3d::UnitY())};
  start.allowed_gain_j = kSheetMass_kg * kGravity_m_per_s2 * kDepth_m;
  return start;
}

// A cloth that leaves a sphere must not fall for ten seconds: the energy would be all rounding.
Collider FloorBelow() {
  return PlaneThrough({0, -1, 0}, Vector3d::UnitY());
}

AtlasCase InsideSphere(const Vector3d& center_m, double radius_m) {
  AtlasCase start{.scene = Grid(kStartSide, kStartSide, 1, 1)};
  start.scene.parameters.colliders = {SphereAt(center_m, radius_m), FloorBelow()};
  start.scene.parameters.friction_static = 0.5;
  start.scene.parameters.friction_dynamic = 0.4;
  start.allowed_gain_j = kSheetMass_kg * kGravity_m_per_s2 * radius_m;
  return start;
}

// At an inner particle, so that it has no way out that is nearer than another.
AtlasCase AtSpheresCentre() {
  const Scene sheet = Grid(kStartSide, kStartSide, 1, 1);
  return InsideSphere(sheet.state.positions_m[5 * kStartSide + 5], 0.3);
}

// A small sheet, all of it inside.
AtlasCase WithinSphere() {
  AtlasCase start = AtSpheresCentre();
  start.scene = Grid(5, 5, 0.2, 0.2);
  start.scene.parameters.colliders = {SphereAt(start.scene.state.positions_m[12], 0.3),
                                      FloorBelow()};
  start.length_m = 0.2;
  return start;
}

AtlasCase FarParticle() {
  AtlasCase start{.scene = HungSheet(kStartSide)};
  start.scene.state.positions_m.back() += Vector3d(50, 30, -80);
  return start;
}

// No energy is gained but by the velocities it has.
AtlasCase FastParticles() {
  AtlasCase start{.scene = HungSheet(kStartSide)};
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-300, 300);
  for (uint32_t i = 1; i < start.scene.model->particle_count(); ++i) {
    if (start.scene.model->inverse_masses_per_kg()[i] == 0) continue;
    start.scene.state.velocities_m_per_s[i] = Vector3d(any(random), any(random), any(random));
  }
  return start;
}

}  // namespace

Scene HungSheet(uint32_t side, const StructuralMaterial& material) {
  Scene scene = Grid(side, side, 1, 1, {0, side - 1}, material);
  const uint32_t links = side - 1;
  const double angle = ArcAngle_rad(links);
  const double radius_m = 1.0 / links / 2 / std::sin(angle / 2);
  const double end = links * angle / 2;
  for (uint32_t i = 0; i < side * side; ++i) {
    const double phi = (i % side) * angle - end;
    scene.state.positions_m[i].x() = radius_m * (std::sin(phi) + std::sin(end));
    scene.state.positions_m[i].y() = radius_m * (std::cos(end) - std::cos(phi));
  }
  return scene;
}

Scene LoadedRope(double ratio) {
  constexpr uint32_t kLinks = 20;
  const Scene chain = Chain(kLinks, 1.0 / kLinks, 0.01);
  std::vector<double> masses_kg(chain.model->masses_kg().begin(), chain.model->masses_kg().end());
  masses_kg.back() *= ratio;
  return WithMasses(chain, std::move(masses_kg));
}

Scene HeavyHem(uint32_t side, double ratio) {
  const Scene sheet = HungSheet(side);
  std::vector<double> masses_kg(sheet.model->masses_kg().begin(), sheet.model->masses_kg().end());
  for (uint32_t k = 0; k < side; ++k) masses_kg[side * (side - 1) + k] *= ratio;
  return WithMasses(sheet, std::move(masses_kg));
}

Scene MixedMasses(uint32_t side, double ratio) {
  const Scene sheet = HungSheet(side);
  std::vector<double> masses_kg(sheet.model->masses_kg().begin(), sheet.model->masses_kg().end());
  for (uint32_t i = 0; i < side * side; ++i) {
    if ((i / side + i % side) % 2 == 1) masses_kg[i] *= ratio;
  }
  return WithMasses(sheet, std::move(masses_kg));
}

std::vector<NamedCase> ConstraintCases() {
  // Compromises: the stretched row; for the impossible triangle the two sides of 1 m when the
  // third, solved last, is kept; the same for the rope.
  return Started({{"straight row pinned at both ends", {.scene = TautRow()}},
                  {"row locked between two corners", {.scene = Grid(16, 16, 1, 1, {0, 15})}},
                  {"pins too far apart", {.scene = PinsTooFarApart(), .least_strain = 0.5}},
                  {"all pairs of 8 particles", {.scene = AllPairs()}},
                  {"both diagonals of each cell", {.scene = Braced()}},
                  {"lengths of no triangle",
                   {.scene = ImpossibleTriangle(), .length_m = 3, .least_strain = 0.5}},
                  {"rope against strut", {.scene = RopeAgainstStrut(), .least_strain = 0.5}},
                  {"joints too far apart", {.scene = JointsTooFarApart(), .least_strain = 0.5}}});
}

std::vector<NamedCase> StartCases() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-0.5, 0.5);
  const auto at_random = [&](const Vector3d&) {
    return Vector3d(any(random), any(random), any(random));
  };
  const auto folded = [](const Vector3d& p) {
    return Vector3d(p.x(), p.y(), std::min(p.z(), 1 - p.z()));
  };
  return Started(
      {{"all at one point", ChangedStart([](const Vector3d&) { return Vector3d(0, 0, 0); })},
       {"all on one line", ChangedStart([](const Vector3d& p) { return Vector3d(p.x(), 0, 0); })},
       {"cells without area", ZeroArea()},
       {"folded onto itself", ChangedStart(folded)},
       {"compressed to half", ChangedStart([](const Vector3d& p) { return Vector3d(0.5 * p); })},
       {"stretched to double", ChangedStart([](const Vector3d& p) { return Vector3d(2 * p); })},
       {"random", ChangedStart(at_random)},
       {"one particle 100 m away", FarParticle()},
       {"random speeds of 300 m/s", FastParticles()},
       {"inside a plane", InsidePlane()},
       {"through a sphere", InsideSphere({0.5, -0.1, 0.5}, 0.3)},
       {"within a sphere at its centre", WithinSphere()},
       {"across a sphere's centre", AtSpheresCentre()}});
}

std::vector<std::string> ImpactColliders() {
  return {"sphere", "plane", "box of 2 cm", "capsule"};
}

AtlasCase Impact(size_t collider, double speed_m_per_s) {
  const Collider colliders[] = {SphereAt({0.5, -0.35, 0.5}, 0.3),
                                PlaneThrough({0, -0.05, 0}, Vector3d::UnitY()),
                                BoxAt({0.5, -0.06, 0.5}, {1, 0.01, 1}),
                                CapsuleBetween({0.2, -0.15, 0.5}, {0.8, -0.15, 0.5}, 0.1)};
  AtlasCase impact{.scene = Grid(12, 12, 1, 1)};
  impact.scene.parameters.colliders = {colliders[collider]};
  impact.scene.parameters.friction_static = 0.5;
  impact.scene.parameters.friction_dynamic = 0.4;
  impact.scene.parameters.thickness_m = 0.002;
  for (Vector3d& v : impact.scene.state.velocities_m_per_s) v.y() = -speed_m_per_s;
  return impact;
}

AtlasCase TeleportingPins(double distance_m, double time_step_s) {
  AtlasCase jumping{.scene = HungSheet(kStartSide), .time_step_s = time_step_s};
  const std::vector<Vector3d> home = {jumping.scene.state.positions_m[0],
                                      jumping.scene.state.positions_m[kStartSide - 1]};
  const auto last_step = static_cast<uint32_t>(std::lround(std::min(1 / time_step_s, 60.0)));
  const Vector3d way = distance_m * Vector3d(3, 5, -4).normalized();
  // Starting and stopping a pin at the speed v is, seen from the pin, a change of all velocities by
  // v: the root mean square speed grows by no more than 2 v each time. There are two per jump.
  const double speed = distance_m / time_step_s;
  const double jumps = last_step / 5.0 + 1;
  jumping.allowed_gain_j = kSheetMass_kg * std::pow(2 * jumps * speed, 2) / 2;
  jumping.pin_targets_m = [=](uint32_t step) {
    std::vector<Vector3d> targets = home;
    if (step < last_step && step % 10 >= 5) {
      for (Vector3d& target : targets) target += way;
    }
    return targets;
  };
  return jumping;
}

std::vector<NamedCase> CaughtCases() {
  const auto across = [](const Collider& collider, const std::vector<uint32_t>& pins = {}) {
    AtlasCase start{.scene = Grid(kStartSide, kStartSide, 1, 1, pins)};
    start.scene.parameters.colliders = {collider, FloorBelow()};
    start.scene.parameters.friction_static = 0.5;
    start.scene.parameters.friction_dynamic = 0.4;
    return start;
  };
  AtlasCase tilted = across(SphereAt({0.5, 0, 0.5}, 0.3));
  for (Vector3d& p : tilted.scene.state.positions_m) {
    p = Eigen::AngleAxisd(0.8, Vector3d::UnitZ()) * (p - Vector3d(0.5, 0, 0)) + Vector3d(0.5, 0, 0);
  }
  return Started({{"sphere, between particles", across(SphereAt({0.5, 0.05, 0.5}, 0.3))},
                  {"sphere, tilted", std::move(tilted)},
                  {"sphere, held by a corner", across(SphereAt({0.5, 0, 0.5}, 0.3), {0})},
                  {"sphere at the rim", across(SphereAt({0.9, 0, 0.5}, 0.3))},
                  {"capsule", across(CapsuleBetween({0.2, 0, 0.5}, {0.8, 0, 0.5}, 0.1))},
                  {"box", across(BoxAt({0.5, 0.02, 0.5}, {0.2, 0.2, 0.2}))}});
}

std::vector<NamedCase> SoakCases() {
  Scene sheet = HungSheet(8);
  sheet.parameters.damping_per_s = 0.1;
  return {{"hung sheet", {.scene = std::move(sheet)}},
          {"sheet on a sphere over a plane", {.scene = FallingOnSphere(8)}},
          {"rope with a load of 100 links", {.scene = LoadedRope(100)}}};
}

}  // namespace drape::test
