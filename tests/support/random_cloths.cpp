#include "tests/support/random_cloths.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Of its own, because the distributions of the standard library differ from one to the next.
class Dice {
 public:
  explicit Dice(uint64_t seed) : engine_(seed) {}

  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  // low .. high, both included.
  uint32_t Count(uint32_t low, uint32_t high) {
    return low + static_cast<uint32_t>(engine_() % (high - low + 1));
  }
  bool Chance(double share) { return Uniform(0, 1) < share; }
  double LogUniform(double low, double high) {
    return std::exp(Uniform(std::log(low), std::log(high)));
  }
  Vector3d InBall() {
    for (;;) {
      const double x = Uniform(-1, 1), y = Uniform(-1, 1), z = Uniform(-1, 1);
      const Vector3d point(x, y, z);
      if (point.norm() <= 1 && point.norm() > 1e-3) return point;
    }
  }
  Vector3d Direction() { return InBall().normalized(); }

 private:
  std::mt19937_64 engine_;
};

constexpr double kLightest_kg = 1e-3;
constexpr double kLargestRatio = 1e3;

// Particles and links under way.
class Plan {
 public:
  std::string form;
  std::vector<Vector3d> positions_m;
  std::vector<uint32_t> pins;

  uint32_t size() const { return static_cast<uint32_t>(positions_m.size()); }
  uint32_t Add(const Vector3d& position_m) {
    positions_m.push_back(position_m);
    return size() - 1;
  }
  // Links that are there already stay single.
  void Link(uint32_t i, uint32_t j) {
    if (i != j && links_.insert(std::minmax(i, j)).second) order_.emplace_back(i, j);
  }
  void LinkAll(const std::vector<uint32_t>& particles) {
    for (size_t a = 0; a < particles.size(); ++a) {
      for (size_t b = a + 1; b < particles.size(); ++b) Link(particles[a], particles[b]);
    }
  }

  Scene MakeScene(const std::vector<double>& masses_kg, Dice& dice) const {
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(dice.Uniform(0, 2 * std::numbers::pi), dice.Direction()));
    ParticleTopology topology;
    for (const Vector3d& p : positions_m) topology.positions_m.push_back(turn * p);
    topology.masses_kg = masses_kg;
    for (const auto& [i, j] : order_) {
      const double length_m = (topology.positions_m[j] - topology.positions_m[i]).norm();
      topology.distance_constraints.push_back({i, j, length_m, 0});
    }
    return Particles(topology, pins);
  }

 private:
  std::set<std::pair<uint32_t, uint32_t>> links_;
  std::vector<std::pair<uint32_t, uint32_t>> order_;
};

// A third of equal masses, a third log-uniform, a third by turns.
std::vector<double> RandomMasses(Plan& plan, Dice& dice) {
  const uint32_t way = dice.Count(0, 2);
  const double ratio = dice.LogUniform(10, kLargestRatio);
  std::vector<double> masses_kg;
  for (uint32_t i = 0; i < plan.size(); ++i) {
    if (way == 0) masses_kg.push_back(0.01);
    if (way == 1) masses_kg.push_back(kLightest_kg * dice.LogUniform(1, ratio));
    if (way == 2) masses_kg.push_back(kLightest_kg * (i % 2 == 0 ? 1 : ratio));
  }
  const std::string r = std::to_string(std::lround(ratio));
  plan.form += way == 0 ? "_equal" : (way == 1 ? "_random" : "_turns") + r;
  return masses_kg;
}

void PinAtRandom(Plan& plan, Dice& dice, uint32_t at_most) {
  const uint32_t count = dice.Count(0, at_most);
  std::set<uint32_t> pins;
  for (uint32_t k = 0; k < count; ++k) pins.insert(dice.Count(0, plan.size() - 1));
  plan.pins.assign(pins.begin(), pins.end());
}

// n hinges around a circle; each and the next are opposite edges of a tetrahedron.
void AddRingOfTetrahedra(Plan& plan, uint32_t hinges, Dice& dice) {
  plan.form = "ring" + std::to_string(hinges);
  const double radius_m = 0.12 * hinges / 3;
  for (uint32_t k = 0; k < hinges; ++k) {
    const double angle = 2 * std::numbers::pi * k / hinges;
    const Vector3d out(std::cos(angle), 0, std::sin(angle));
    // By turns up and along the ring, so that the tetrahedra are not flat.
    const Vector3d along = k % 2 == 0 ? Vector3d::UnitY() : Vector3d(-out.z(), 0, out.x());
    const Vector3d axis = (along + dice.Uniform(0, 0.4) * dice.InBall()).normalized();
    const Vector3d middle = radius_m * out + 0.02 * dice.InBall();
    const double half_m = dice.Uniform(0.08, 0.16);
    plan.Add(middle - half_m * axis);
    plan.Add(middle + half_m * axis);
  }
  for (uint32_t k = 0; k < hinges; ++k) {
    const uint32_t next = (k + 1) % hinges;
    plan.LinkAll({2 * k, 2 * k + 1, 2 * next, 2 * next + 1});
  }
}

// Tetrahedra that hang on each other by corners, closed to a ring or not.
void AddTetrahedraByCorners(Plan& plan, uint32_t count, bool is_ring, Dice& dice) {
  plan.form = (is_ring ? "corner_ring" : "corner_chain") + std::to_string(count);
  const double radius_m = 0.25 * count / std::numbers::pi / 2;
  const auto corner = [&](uint32_t k) -> Vector3d {
    const double angle = 2 * std::numbers::pi * k / count;
    return is_ring ? Vector3d(radius_m * std::cos(angle), 0, radius_m * std::sin(angle))
                   : Vector3d(0.25 * k, 0, 0);
  };
  uint32_t first = plan.Add(corner(0)), last = first;
  for (uint32_t k = 0; k < count; ++k) {
    const Vector3d middle = (corner(k) + corner(k + 1)) / 2;
    const uint32_t a = plan.Add(middle + Vector3d(0, 0.12, 0) + 0.03 * dice.InBall());
    const uint32_t b = plan.Add(middle - Vector3d(0, 0.12, 0) + 0.03 * dice.InBall());
    const uint32_t next = is_ring && k + 1 == count ? first : plan.Add(corner(k + 1));
    plan.LinkAll({last, a, b, next});
    if (dice.Chance(0.5)) plan.positions_m[a] += Vector3d(0, 0, 0.08);
    last = next;
  }
}

void AddNeighbours(Plan& plan, Dice& dice) {
  const uint32_t count = dice.Count(8, 30);
  const uint32_t degree = dice.Count(2, 6);
  plan.form = "cloud" + std::to_string(count) + "_" + std::to_string(degree);
  for (uint32_t i = 0; i < count; ++i) {
    for (;;) {  // not too close to another one
      const Vector3d p = 0.5 * dice.InBall();
      if (std::ranges::all_of(plan.positions_m,
                              [&](const Vector3d& q) { return (p - q).norm() > 0.08; })) {
        plan.Add(p);
        break;
      }
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    std::vector<std::pair<double, uint32_t>> others;
    for (uint32_t j = 0; j < count; ++j) {
      if (j != i) others.emplace_back((plan.positions_m[j] - plan.positions_m[i]).norm(), j);
    }
    std::sort(others.begin(), others.end());
    for (uint32_t k = 0; k < std::min<size_t>(degree, others.size()); ++k) {
      plan.Link(i, others[k].second);
    }
  }
}

void MakeLinkage(Plan& plan, Dice& dice) {
  switch (dice.Count(0, 3)) {
    case 0:
      AddRingOfTetrahedra(plan, 6, dice);
      break;
    case 1:
      AddRingOfTetrahedra(plan, 2 * dice.Count(3, 7), dice);
      break;
    case 2:
      AddTetrahedraByCorners(plan, dice.Count(4, 10), dice.Chance(0.5), dice);
      break;
    default:
      AddNeighbours(plan, dice);
  }
  PinAtRandom(plan, dice, 2);
}

// A ladder, or a box of four rails; braced by one diagonal per side of a bay or by two.
void MakeFrame(Plan& plan, Dice& dice) {
  const uint32_t bays = dice.Count(2, 16);
  const uint32_t rails = dice.Chance(0.4) ? 2 : 4;
  const bool is_braced_twice = dice.Chance(0.5);
  plan.form = (rails == 2 ? "ladder" : "beam") + std::to_string(bays) +
              (is_braced_twice ? "_twice" : "_once");
  const double width_m = dice.Uniform(0.05, 0.2), bay_m = dice.Uniform(0.05, 0.2);
  for (uint32_t k = 0; k <= bays; ++k) {
    for (uint32_t r = 0; r < rails; ++r) {
      const double y = r == 1 || r == 2 ? width_m : 0, z = r >= 2 ? width_m : 0;
      plan.Add({bay_m * k, y, z});
    }
  }
  const uint32_t sides = rails == 2 ? 1 : 4;
  for (uint32_t k = 0; k <= bays; ++k) {
    for (uint32_t s = 0; s < sides; ++s) {
      const uint32_t a = rails * k + s, b = rails * k + (s + 1) % rails;
      plan.Link(a, b);
      if (k == bays) continue;
      plan.Link(a, a + rails);
      plan.Link(b, b + rails);
      plan.Link(a, b + rails);
      if (is_braced_twice) plan.Link(b, a + rails);
    }
  }
  const uint32_t held = dice.Count(0, 2);
  for (uint32_t r = 0; r < std::min(held == 2 ? rails : held, rails); ++r) plan.pins.push_back(r);
}

void MakeChain(Plan& plan, Dice& dice) {
  const uint32_t links = dice.Count(5, 60);
  plan.form = "chain" + std::to_string(links);
  const double link_m = dice.Uniform(0.02, 0.1);
  for (uint32_t i = 0; i <= links; ++i) plan.Add({link_m * i, 0, 0});
  for (uint32_t i = 0; i < links; ++i) plan.Link(i, i + 1);
  const uint32_t ends = dice.Count(0, 3);
  if (ends > 0) plan.pins.push_back(0);
  if (ends == 3) {  // closer together than the chain is long
    plan.pins.push_back(links);
    plan.form += "_both";
    const double turn = dice.Uniform(0.5, 2.5) / links;
    Vector3d p = Vector3d::Zero();
    for (uint32_t i = 0; i <= links; ++i) {
      plan.positions_m[i] = p;
      const double angle = turn * (i - 0.5 * (links - 1));
      p += link_m * Vector3d(std::cos(angle), std::sin(angle), 0);
    }
  }
}

void MakeTree(Plan& plan, Dice& dice) {
  const uint32_t count = dice.Count(8, 60);
  const uint32_t reach = dice.Count(1, 12);
  plan.form = "tree" + std::to_string(count);
  plan.Add(Vector3d::Zero());
  for (uint32_t i = 1; i < count; ++i) {
    const uint32_t parent = i - 1 - dice.Count(0, std::min(i, reach) - 1);
    plan.Add(plan.positions_m[parent] + dice.Uniform(0.03, 0.12) * dice.Direction());
    plan.Link(parent, i);
  }
  if (dice.Chance(0.7)) plan.pins.push_back(0);
}

// Rows and columns; `hole_share` of the links are missing.
void AddSquares(Plan& plan, uint32_t columns, uint32_t rows, double hole_share, Dice& dice) {
  const double cell_m = dice.Uniform(0.02, 0.08);
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t column = 0; column < columns; ++column) {
      const uint32_t i = plan.Add({cell_m * column, 0, cell_m * row});
      if (column > 0 && !dice.Chance(hole_share)) plan.Link(i - 1, i);
      if (row > 0 && !dice.Chance(hole_share)) plan.Link(i - columns, i);
    }
  }
}

void MakeNet(Plan& plan, Dice& dice) {
  const uint32_t columns = dice.Count(4, 16), rows = dice.Count(4, 16);
  plan.form = "net" + std::to_string(columns) + "x" + std::to_string(rows);
  AddSquares(plan, columns, rows, dice.Uniform(0, 0.3), dice);
  PinAtRandom(plan, dice, 4);
}

void MakeSheet(Plan& plan, Dice& dice) {
  const uint32_t columns = dice.Count(6, 20), rows = dice.Count(6, 20);
  plan.form = "sheet" + std::to_string(columns) + "x" + std::to_string(rows);
  AddSquares(plan, columns, rows, 0, dice);
  if (dice.Chance(0.4)) {
    for (uint32_t column = 0; column < columns; ++column) plan.pins.push_back(column);
  } else {
    PinAtRandom(plan, dice, 4);
  }
}

void MakeMesh(Plan& plan, Dice& dice) {
  const uint32_t columns = dice.Count(4, 10), rows = dice.Count(4, 10);
  plan.form = "mesh" + std::to_string(columns) + "x" + std::to_string(rows);
  AddSquares(plan, columns, rows, 0, dice);
  for (uint32_t row = 0; row + 1 < rows; ++row) {
    for (uint32_t column = 0; column + 1 < columns; ++column) {
      const uint32_t a = row * columns + column, d = a + columns + 1;
      if (dice.Chance(0.5)) {
        plan.Link(a, d);
      } else {
        plan.Link(a + 1, d - 1);
      }
    }
  }
  const double cell_m = (plan.positions_m[1] - plan.positions_m[0]).norm();
  for (Vector3d& p : plan.positions_m) p += 0.25 * cell_m * dice.InBall();
  PinAtRandom(plan, dice, 3);
}

// Turning and moving as one, and each particle on its own.
void SetVelocities(Scene& scene, Dice& dice) {
  if (dice.Chance(0.3)) return;  // let go at rest
  const Vector3d turn_per_s = dice.Uniform(0, 2) * dice.Direction();
  const Vector3d motion = dice.Uniform(0, 1) * dice.Direction();
  const double stir = dice.Chance(0.5) ? dice.Uniform(0, 0.5) : 0;
  const bool is_free = scene.model->pin_count() == 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    const Vector3d own = stir * dice.InBall();
    if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
    Vector3d& v = scene.state.velocities_m_per_s[i];
    v = own;
    if (is_free) v += motion + turn_per_s.cross(scene.state.positions_m[i]);
  }
}

void SetHem(const Plan& plan, std::vector<double>& masses_kg, Dice& dice) {
  const double ratio = dice.LogUniform(10, kLargestRatio);
  double lowest = 0;
  for (const Vector3d& p : plan.positions_m) lowest = std::max(lowest, p.z());
  for (uint32_t i = 0; i < plan.size(); ++i) {
    masses_kg[i] = plan.positions_m[i].z() > lowest - 1e-9 ? kLightest_kg * ratio : kLightest_kg;
  }
}

}  // namespace

Scene RandomCloth(RandomKind kind, uint64_t seed) {
  Dice dice(1000 * seed + static_cast<uint64_t>(kind));
  Plan plan;
  switch (kind) {
    case RandomKind::kLinkage:
      MakeLinkage(plan, dice);
      break;
    case RandomKind::kFrame:
      MakeFrame(plan, dice);
      break;
    case RandomKind::kChain:
      MakeChain(plan, dice);
      break;
    case RandomKind::kTree:
      MakeTree(plan, dice);
      break;
    case RandomKind::kNet:
      MakeNet(plan, dice);
      break;
    case RandomKind::kSheet:
      MakeSheet(plan, dice);
      break;
    case RandomKind::kMesh:
      MakeMesh(plan, dice);
      break;
  }
  std::vector<double> masses_kg = RandomMasses(plan, dice);
  if (kind == RandomKind::kSheet && dice.Chance(0.3)) {
    plan.form += "_hem";
    SetHem(plan, masses_kg, dice);
  }
  Scene scene = plan.MakeScene(masses_kg, dice);
  scene.name = std::string(kRandomKindNames.at(static_cast<size_t>(kind))) + "_" + plan.form +
               "_seed" + std::to_string(seed);
  SetVelocities(scene, dice);
  return scene;
}

double EnergyScale_j(const Scene& scene) {
  Vector3d low = scene.state.positions_m.at(0), high = low;
  double kinetic_j = 0, mass_kg = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    low = low.cwiseMin(scene.state.positions_m[i]);
    high = high.cwiseMax(scene.state.positions_m[i]);
    if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
    mass_kg += scene.model->masses_kg()[i];
    kinetic_j += scene.model->masses_kg()[i] * scene.state.velocities_m_per_s[i].squaredNorm() / 2;
  }
  return mass_kg * scene.parameters.gravity_m_per_s2.norm() * (high - low).norm() + kinetic_j;
}

double Energy_j(const Scene& scene, const ParticleState& state, double lag_m_per_s) {
  double energy_j = 0;
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
    const double speed = std::max(state.velocities_m_per_s[i].norm() - lag_m_per_s, 0.0);
    energy_j += scene.model->masses_kg()[i] *
                (speed * speed / 2 - scene.parameters.gravity_m_per_s2.dot(state.positions_m[i]));
  }
  return energy_j;
}

}  // namespace drape::test
