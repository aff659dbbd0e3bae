#include "tests/support/planar_chain.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "server/core/check.h"
#include "tests/support/closed_forms.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
using Link = PlanarChain::Link;

// Names: e unit vector along a link, away from the pivot; T its tension; l, m length and mass of a
// link; w its angular velocity; a acceleration of a particle. Index k: link k and its lower end.

Vector3d Along(double angle) {
  return {std::sin(angle), -std::cos(angle), 0};
}

Vector3d Across(double angle) {
  return {std::cos(angle), std::sin(angle), 0};
}

// A particle is pulled up by its link and down by the next one and by gravity:
//   a_k = g + (T_{k+1} e_{k+1} - T_k e_k) / m_k,   a_pivot = 0,
// and a rigid link needs (a_k - a_{k-1}) . e_k = -l_k w_k^2. Put together that is one symmetric
// tridiagonal system for the tensions, solved by elimination without pivoting (it is positive
// definite: J M^-1 J^T of independent constraints).
std::vector<double> SolveTensions(const std::vector<Link>& links, double gravity) {
  const size_t n = links.size();
  std::vector<double> diagonal(n), beyond(n, 0.0), tension(n);  // beyond: of T_{k+1} in row k
  for (size_t k = 0; k < n; ++k) {
    const Link& link = links[k];
    diagonal[k] = 1 / link.mass_kg + (k > 0 ? 1 / links[k - 1].mass_kg : 0);
    tension[k] = link.length_m * link.rate_rad_s * link.rate_rad_s;
    if (k == 0) tension[k] += gravity * std::cos(link.angle_rad);
    if (k + 1 < n) beyond[k] = -std::cos(links[k + 1].angle_rad - link.angle_rad) / link.mass_kg;
  }
  for (size_t k = 1; k < n; ++k) {
    const double factor = beyond[k - 1] / diagonal[k - 1];
    diagonal[k] -= factor * beyond[k - 1];
    tension[k] -= factor * tension[k - 1];
  }
  for (size_t k = n; k-- > 0;) {
    if (k + 1 < n) tension[k] -= beyond[k] * tension[k + 1];
    tension[k] /= diagonal[k];
  }
  return tension;
}

// l_k dw_k/dt is what is left of the relative acceleration across the link.
std::vector<double> AngularAccelerations(const std::vector<Link>& links, double gravity) {
  const std::vector<double> tension = SolveTensions(links, gravity);
  std::vector<double> result(links.size());
  Vector3d above = Vector3d::Zero();  // acceleration of the particle before
  for (size_t k = 0; k < links.size(); ++k) {
    const Link& link = links[k];
    Vector3d force = -tension[k] * Along(link.angle_rad);
    if (k + 1 < links.size()) force += tension[k + 1] * Along(links[k + 1].angle_rad);
    const Vector3d acceleration = force / link.mass_kg - Vector3d(0, gravity, 0);
    result[k] = (acceleration - above).dot(Across(link.angle_rad)) / link.length_m;
    above = acceleration;
  }
  return result;
}

// d angle/dt and d rate/dt of every link.
struct Slope {
  std::vector<double> rates;
  std::vector<double> accelerations;
};

Slope SlopeOf(const std::vector<Link>& links, double gravity) {
  Slope slope;
  slope.accelerations = AngularAccelerations(links, gravity);
  for (const Link& link : links) slope.rates.push_back(link.rate_rad_s);
  return slope;
}

std::vector<Link> Moved(std::vector<Link> links, const Slope& slope, double h) {
  for (size_t k = 0; k < links.size(); ++k) {
    links[k].angle_rad += h * slope.rates[k];
    links[k].rate_rad_s += h * slope.accelerations[k];
  }
  return links;
}

}  // namespace

PlanarChain::PlanarChain(std::vector<Link> links, double gravity_m_per_s2)
    : links_(std::move(links)), gravity_(gravity_m_per_s2) {
  DRAPE_CHECK(!links_.empty(), "a chain has at least one link");
}

void PlanarChain::Advance(double duration_s, uint32_t steps) {
  const double h = duration_s / steps;
  for (uint32_t step = 0; step < steps; ++step) {
    const Slope k1 = SlopeOf(links_, gravity_);
    const Slope k2 = SlopeOf(Moved(links_, k1, h / 2), gravity_);
    const Slope k3 = SlopeOf(Moved(links_, k2, h / 2), gravity_);
    const Slope k4 = SlopeOf(Moved(links_, k3, h), gravity_);
    for (size_t k = 0; k < links_.size(); ++k) {
      links_[k].angle_rad +=
          h / 6 * (k1.rates[k] + 2 * k2.rates[k] + 2 * k3.rates[k] + k4.rates[k]);
      links_[k].rate_rad_s += h / 6 *
                              (k1.accelerations[k] + 2 * k2.accelerations[k] +
                               2 * k3.accelerations[k] + k4.accelerations[k]);
    }
  }
}

double PlanarChain::AdvanceConverged(double duration_s, double tolerance_m) {
  const std::vector<Link> start = links_;
  std::vector<Vector3d> coarse;
  for (uint32_t steps = 64; steps <= 1u << 24; steps *= 2) {
    links_ = start;
    Advance(duration_s, steps);
    const std::vector<Vector3d> fine = Positions_m();
    double change = coarse.empty() ? HUGE_VAL : 0;
    for (size_t k = 0; k < coarse.size(); ++k) {
      const double moved = (fine[k] - coarse[k]).norm();
      change = std::isfinite(moved) ? std::max(change, moved) : HUGE_VAL;
    }
    if (change <= 15 * tolerance_m) return change / 15;
    coarse = fine;
  }
  DRAPE_CHECK(false, "the chain does not converge to the tolerance asked for");
  return HUGE_VAL;
}

std::vector<Vector3d> PlanarChain::Positions_m() const {
  std::vector<Vector3d> positions = {Vector3d::Zero()};
  for (const Link& link : links_) {
    positions.push_back(positions.back() + link.length_m * Along(link.angle_rad));
  }
  return positions;
}

std::vector<Vector3d> PlanarChain::Velocities_m_per_s() const {
  std::vector<Vector3d> velocities = {Vector3d::Zero()};
  for (const Link& link : links_) {
    velocities.push_back(velocities.back() +
                         link.length_m * link.rate_rad_s * Across(link.angle_rad));
  }
  return velocities;
}

std::vector<double> PlanarChain::Tensions_n() const {
  return SolveTensions(links_, gravity_);
}

double PlanarChain::Energy_j() const {
  const std::vector<Vector3d> p = Positions_m(), v = Velocities_m_per_s();
  double energy = 0;
  for (size_t k = 0; k < links_.size(); ++k) {
    energy += links_[k].mass_kg * (v[k + 1].squaredNorm() / 2 + gravity_ * p[k + 1].y());
  }
  return energy;
}

PlanarChain StraightChain(uint32_t link_count, double link_m, double mass_kg, double angle_rad) {
  return PlanarChain(std::vector<Link>(
      link_count, Link{.length_m = link_m, .mass_kg = mass_kg, .angle_rad = angle_rad}));
}

PlanarChain ChainInMode(uint32_t link_count, double link_m, double mass_kg, double z,
                        double steepest_rad) {
  std::vector<Link> links(link_count, Link{.length_m = link_m, .mass_kg = mass_kg});
  double steepest = 0, above = 0;  // sideways displacement of the particle above
  for (uint32_t k = 0; k < link_count; ++k) {
    const double here = Laguerre(link_count - 1 - k, z);
    links[k].angle_rad = here - above;
    steepest = std::max(steepest, std::abs(here - above));
    above = here;
  }
  for (Link& link : links) link.angle_rad *= steepest_rad / steepest;
  return PlanarChain(links);
}

PlanarChain CurtainColumn(uint32_t rows, double height_m) {
  return StraightChain(rows - 1, height_m / (rows - 1), 1, std::numbers::pi / 2);
}

}  // namespace drape::test
