#include "tests/support/capstan.h"

#include <Eigen/Geometry>
#include <cmath>

namespace drape::test {

using Eigen::Vector3d;

double CapstanBar::link_m() const {
  return 2 * radius_m * std::sin(corner() / 2);
}

double CapstanBar::SlipLoad_kg() const {
  const double mu = friction_static;
  double tension = light_kg + (hanging - 1) * link_kg;  // over g
  for (uint32_t k = 0; k <= turns; ++k) {
    const double before = k == 0 ? 0 : corner() / 2, after = k == turns ? 0 : corner() / 2;
    const double held = tension * (std::cos(before) + mu * std::sin(before)) -
                        link_kg * (std::cos(AngleOf(k)) - mu * std::sin(AngleOf(k)));
    tension = held / (std::cos(after) - mu * std::sin(after));
  }
  return tension - (hanging - 1) * link_kg;
}

double CapstanBar::Acceleration(double share) const {
  const double gravity = ClothParameters().gravity_m_per_s2.norm();
  const double chain_kg = (turns + 1 + 2 * (hanging - 1)) * link_kg;
  return (share - 1) * SlipLoad_kg() * gravity / (share * SlipLoad_kg() + light_kg + chain_kg);
}

Scene CapstanBar::Loaded(double share, const StepSettings& settings) const {
  const Eigen::AngleAxisd turn(direction, Vector3d::UnitY());
  ParticleTopology chain;
  const auto add = [&](double x, double y) {
    chain.positions_m.push_back(place_m + turn * Vector3d(x, y, 0));
  };
  for (uint32_t k = hanging; k >= 1; --k) add(-radius_m, -link_m() * k);
  for (uint32_t k = 0; k <= turns; ++k) {
    add(radius_m * std::cos(AngleOf(k)), radius_m * std::sin(AngleOf(k)));
  }
  for (uint32_t k = 1; k <= hanging; ++k) add(radius_m, -link_m() * k);
  chain.masses_kg.assign(chain.positions_m.size(), link_kg);
  chain.masses_kg.front() = light_kg;
  chain.masses_kg.back() = share * SlipLoad_kg();
  for (uint32_t k = 0; k + 1 < chain.positions_m.size(); ++k) {
    chain.distance_constraints.push_back({.i = k, .j = k + 1, .rest_length_m = link_m()});
  }
  Scene scene = Particles(chain);
  const Vector3d along = turn * Vector3d::UnitZ();
  scene.parameters.colliders = {CapsuleBetween(place_m - along, place_m + along, radius_m)};
  scene.parameters.friction_static = friction_static;
  scene.parameters.friction_dynamic = dynamic * friction_static;
  scene.parameters.settings = settings;
  scene.parameters.settings.time_step_s = time_step_s;
  return scene;
}

}  // namespace drape::test
