#include "tests/support/elastica.h"

#include <Eigen/Dense>
#include <cmath>
#include <functional>

namespace drape::test {

std::vector<double> HangingAngles(const StiffChain& chain, double gravity_m_per_s2) {
  const Eigen::Index links = static_cast<Eigen::Index>(chain.masses_kg.size()) - 1;
  Eigen::VectorXd beyond(links);  // weight beyond each link
  double weight = 0;
  for (Eigen::Index k = links - 1; k >= 0; --k) {
    weight += chain.masses_kg[static_cast<size_t>(k) + 1] * gravity_m_per_s2;
    beyond[k] = weight;
  }
  Eigen::VectorXd angles = Eigen::VectorXd::Zero(links);
  for (int iteration = 0; iteration < 200; ++iteration) {
    Eigen::VectorXd error = Eigen::VectorXd::Zero(links);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Identity(links, links);
    for (Eigen::Index k = 1; k < links; ++k) {
      const double stiffness = chain.stiffnesses_n_m[static_cast<size_t>(k)];
      error[k] = stiffness * std::sin(angles[k] - angles[k - 1]);
      jacobian(k, k) = stiffness * std::cos(angles[k] - angles[k - 1]);
      jacobian(k, k - 1) = -jacobian(k, k);
      for (Eigen::Index i = k; i < links; ++i) {
        error[k] -= chain.link_m * beyond[i] * std::cos(angles[i]);
        jacobian(k, i) += chain.link_m * beyond[i] * std::sin(angles[i]);
      }
    }
    const Eigen::VectorXd change = jacobian.partialPivLu().solve(error);
    angles -= change * std::min(1.0, 0.2 / std::max(change.cwiseAbs().maxCoeff(), 1e-300));
    if (change.cwiseAbs().maxCoeff() < 1e-14) break;
  }
  return {angles.begin(), angles.end()};
}

Vibration SlowestVibration(const StiffChain& chain) {
  const Eigen::Index lines = static_cast<Eigen::Index>(chain.masses_kg.size());
  const Eigen::Index free = lines - 2;
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(free, free);
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(free, free);
  for (Eigen::Index k = 1; k + 1 < lines; ++k) {
    // The angle at line k: the second difference of the displacements over the link.
    Eigen::VectorXd angle = Eigen::VectorXd::Zero(free);
    if (k - 1 >= 2) angle[k - 3] = 1 / chain.link_m;
    if (k >= 2) angle[k - 2] = -2 / chain.link_m;
    angle[k - 1] = 1 / chain.link_m;
    stiffness += chain.stiffnesses_n_m[static_cast<size_t>(k)] * angle * angle.transpose();
  }
  for (Eigen::Index k = 0; k < free; ++k) mass(k, k) = chain.masses_kg[static_cast<size_t>(k) + 2];
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(stiffness, mass);
  Vibration vibration{.frequency_per_s = std::sqrt(solver.eigenvalues()[0]), .shape = {0, 0}};
  const Eigen::VectorXd mode = solver.eigenvectors().col(0) / solver.eigenvectors()(free - 1, 0);
  vibration.shape.insert(vibration.shape.end(), mode.begin(), mode.end());
  return vibration;
}

namespace {

struct Elastica {
  double curvature_at_end;  // times the length
  double drop;              // over the length
};

// In units of the length: a'' = -load (1 - s) cos a from a(0) = 0, a'(0) = curvature.
Elastica Integrate(double load, double curvature, int steps) {
  struct State {
    double angle, curvature, drop;
  };
  const auto slope = [&](double s, const State& at) {
    return State{at.curvature, -load * (1 - s) * std::cos(at.angle), std::sin(at.angle)};
  };
  const auto add = [](const State& a, double factor, const State& b) {
    return State{a.angle + factor * b.angle, a.curvature + factor * b.curvature,
                 a.drop + factor * b.drop};
  };
  State state{0, curvature, 0};
  const double h = 1.0 / steps;
  for (int k = 0; k < steps; ++k) {
    const double s = k * h;
    const State k1 = slope(s, state);
    const State k2 = slope(s + h / 2, add(state, h / 2, k1));
    const State k3 = slope(s + h / 2, add(state, h / 2, k2));
    const State k4 = slope(s + h, add(state, h, k3));
    state = add(add(add(add(state, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  }
  return {state.curvature, state.drop};
}

// The curvature at the beginning for which there is none at the end is between 0 and that of a
// strip that stays straight, load / 2.
double ShootDrop(double load, int steps) {
  double low = 0, high = load / 2;
  for (int bisection = 0; bisection < 100; ++bisection) {
    const double middle = (low + high) / 2;
    (Integrate(load, middle, steps).curvature_at_end < 0 ? low : high) = middle;
  }
  return Integrate(load, (low + high) / 2, steps).drop;
}

}  // namespace

double ElasticaDrop_m(double length_m, double rigidity_n_m2, double weight_n_per_m) {
  const double load = weight_n_per_m * std::pow(length_m, 3) / rigidity_n_m2;
  double drop = ShootDrop(load, 64);
  for (int steps = 128; steps <= 65536; steps *= 2) {
    const double finer = ShootDrop(load, steps);
    const bool stands_still = std::abs(finer - drop) < 1e-10;
    drop = finer;
    if (stands_still) break;
  }
  return drop * length_m;
}

}  // namespace drape::test
