// Hanging cloths: the tension of every link of a column, the modes of a chain, the shape of a
// hammock at any resolution.
#include <algorithm>
#include <numbers>

#include "tests/physics/chain_scene.h"
#include "tests/physics/preset_test.h"
#include "tests/support/closed_forms.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;

class Hanging : public PhysicsTest {};

// Each link of a column carries the masses below it, T_k = g times their sum, and a compliant one
// is longer by alpha T_k, with ten sweeps as with two hundred: no stiffening. The column starts at
// rest in that place with the velocity that a hanging particle has between substeps, -g h / 2, so
// it has nowhere to move. A sweep visits the links colour by colour and leaves at most the share
// (w_i + w_j) / (w_i + w_j + alpha / h^2) of the impulses' errors, below 15 / 130 here, which after
// ten sweeps is nothing.
TEST_P(Hanging, EachLinkOfAColumnCarriesWhatIsBelow) {
  constexpr uint32_t kLinks = 6;
  constexpr double kLink_m = 0.25, kCompliance_m_per_n = 2e-3;
  ParticleTopology column;
  std::vector<double> tensions(kLinks, 0.0);
  for (uint32_t k = 0; k <= kLinks; ++k) {
    column.masses_kg.push_back(0.1 * (1 + k % 3));
    for (uint32_t link = 0; link < k; ++link) tensions[link] += kG * column.masses_kg[k];
  }
  double height = 0;
  for (uint32_t k = 0; k <= kLinks; ++k) {
    column.positions_m.emplace_back(0, height, 0);
    if (k < kLinks) {
      column.distance_constraints.push_back({k, k + 1, kLink_m, kCompliance_m_per_n});
      height -= kLink_m + kCompliance_m_per_n * tensions[k];
    }
  }
  Scene scene = Particles(column, {0});
  scene.parameters.settings = SingleSubstep(1.0 / 60);
  scene.parameters.settings.substeps = 4;
  const double h = scene.parameters.settings.substep_s();
  for (uint32_t k = 1; k <= kLinks; ++k) {
    scene.state.velocities_m_per_s[k] = Vector3d(0, -kG * h / 2, 0);
  }
  // Positions of up to 2 m: 5 roundings of that size in a length.
  const double bound =
      2 * std::pow(15.0 / 130, 10) * tensions[0] + 5 * 2 * round_off() / kCompliance_m_per_n;
  for (const uint32_t sweeps : {1u, 2u, 10u, 50u, 200u}) {
    scene.parameters.settings.max_iterations = sweeps;
    const ParticleState state = StateAfter(scene, 120);
    double worst = 0;
    for (uint32_t k = 0; k < kLinks; ++k) {
      const double length = (state.positions_m[k + 1] - state.positions_m[k]).norm();
      const double off = (length - kLink_m) / kCompliance_m_per_n - tensions[k];
      worst = std::max(worst, std::abs(off) / tensions[k]);
      if (sweeps >= 10) {
        EXPECT_LE(std::abs(off), bound) << "link " << k << " with " << sweeps << " sweeps";
      }
    }
    // Found by too few sweeps, an elongation is off in the other direction: too long.
    std::printf(
        "[ MEASURED ] elongation of a column of %u links with %u sweeps on %s: off by at "
        "most %.3g %%\n",
        kLinks, sweeps, GetParam().c_str(), 100 * worst);
  }
}

// The sum over the halves of a discrete catenary of `links` links: tan(angle_k) = (k + 1/2 - n/2) /
// stiffness, where stiffness is the horizontal tension in weights of a particle. Found by
// bisection.
struct DiscreteCatenary {
  DiscreteCatenary(uint32_t links, double length_m, double span_m) {
    double low = 1e-9, high = 1e9;  // of the horizontal tension
    for (int step = 0; step < 200; ++step) {
      const double middle = std::sqrt(low * high);
      (Span(links, length_m, middle) < span_m ? low : high) = middle;
    }
    sag_m = 0;
    for (uint32_t k = 0; k < links / 2; ++k) {
      const double tangent = Tangent(links, k, low);
      sag_m += length_m / links * tangent / std::sqrt(1 + tangent * tangent);
    }
  }
  static double Tangent(uint32_t links, uint32_t k, double tension) {
    return std::abs(k + 0.5 - links / 2.0) / tension;
  }
  static double Span(uint32_t links, double length_m, double tension) {
    double span = 0;
    for (uint32_t k = 0; k < links; ++k) {
      const double tangent = Tangent(links, k, tension);
      span += length_m / links / std::sqrt(1 + tangent * tangent);
    }
    return span;
  }
  double sag_m;
};

// s = 2 a sinh(span / 2a) gives a, the sag is a (cosh(span / 2a) - 1).
double CatenarySag(double length_m, double span_m) {
  double low = 1e-2 * span_m, high = 1e3 * span_m;
  for (int step = 0; step < 200; ++step) {
    const double a = std::sqrt(low * high);
    (2 * a * std::sinh(span_m / (2 * a)) > length_m ? low : high) = a;
  }
  return low * (std::cosh(span_m / (2 * low)) - 1);
}

// The same hammock of 4, 8 and 16 cells, held by two opposite edges that are closer than it is
// long: its sag is that of the discrete catenary, whose distance from the catenary falls to a
// quarter when the cells are halved. Pins at both ends, 0.8 of the length apart.
TEST_P(Hanging, AHammockHasOneShapeAtAnyResolution) {
  constexpr double kLength_m = 1, kSpan_m = 0.8;
  const double exact = CatenarySag(kLength_m, kSpan_m);
  double previous = 0;
  for (const uint32_t cells : {4u, 8u, 16u}) {
    const DiscreteCatenary discrete(cells, kLength_m, kSpan_m);
    const double off = std::abs(discrete.sag_m - exact);
    if (previous > 0) {
      EXPECT_NEAR(previous / off, 4, 0.5) << "second order in the resolution";
    }
    previous = off;

    const uint32_t columns = cells + 1, rows = 3;
    std::vector<uint32_t> pins;
    for (uint32_t row = 0; row < rows; ++row) {
      pins.push_back(row * columns);
      pins.push_back(row * columns + cells);
    }
    Scene scene = Grid(columns, rows, kLength_m, 2 * kLength_m / cells, pins);
    const double half_depth = std::sqrt(kLength_m * kLength_m - kSpan_m * kSpan_m) / 2;
    for (Vector3d& p : scene.state.positions_m) {
      p = {kSpan_m * p.x(), -2 * half_depth * std::min(p.x(), kLength_m - p.x()), p.z()};
    }
    scene.parameters.damping_per_s = 8;
    scene.parameters.settings = SingleSubstep(1.0 / 60, 8);
    scene.parameters.settings.substeps = 32;
    const double h = scene.parameters.settings.substep_s();
    const ParticleState state = StateAfter(scene, 180);
    // As in equilibrium_test: while the impulses of a substep are found, a particle is away from
    // where it stays by at most its tension's share of g h^2, here at most cells g h^2, at each of
    // the particles between the edge and the middle.
    const double bound = cells * cells / 2.0 * kG * h * h + 16 * cells * round_off() * kLength_m;
    EXPECT_NEAR(-state.positions_m[columns + cells / 2].y(), discrete.sag_m, bound) << cells;
  }
}

class Modes : public PresetTest {};

// The small modes are w^2 = (g/l) z with z the zeros of the Laguerre polynomial L_n. Released at
// rest in each of them, the chain passes the middle after a quarter of the period, up to the
// nonlinear part at this angle, which the exact chain gives (planar_chain_test.cpp compares it with
// the polynomial at an angle of 1e-4). The share of the mode that is left is compared. Without
// tethers: they also hold a chain that is taut up to less than g h^2, in another direction than its
// links (tests/bench/notes/physics.md).
TEST_P(Modes, OfAChainAreTheZerosOfTheLaguerrePolynomial) {
  constexpr uint32_t kLinks = 4;
  constexpr double kLink_m = 0.25, kSteepest_rad = 0.03;
  for (const double z : LaguerreZeros(kLinks)) {
    const PlanarChain start = ChainInMode(kLinks, kLink_m, 0.1, z, kSteepest_rad);
    const std::vector<Vector3d> shape = start.Positions_m();
    const auto share_left = [&](const std::vector<Vector3d>& positions) {
      double product = 0, norm = 0;
      for (uint32_t i = 0; i <= kLinks; ++i) {
        product += shape[i].x() * positions[i].x();
        norm += shape[i].x() * shape[i].x();
      }
      return product / norm;
    };
    const double quarter = std::numbers::pi / 2 / std::sqrt(kG / kLink_m * z);
    PlanarChain exact = start;
    exact.AdvanceConverged(quarter, 1e-11);
    std::array<double, 3> shares{};
    double reach = 0;
    for (const Vector3d& p : shape) reach = std::max(reach, std::abs(p.x()));
    for (size_t k = 0; k < 3; ++k) {
      Scene scene = SceneOf(start);
      scene.parameters.settings = SchemeSettings(preset(), quarter, 60u << k, 60);
      scene.parameters.settings.use_tethers = false;
      shares[k] = share_left(StateAfter(scene).positions_m);
    }
    // Each of 240 substeps rounds positions of up to 1 m once, and velocities, which are small.
    ExpectLimit(shares, order(), share_left(exact.Positions_m()), 240 * round_off() / reach,
                "mode " + std::to_string(z));
    // Particles rise and fall by at most n l a^2 / 2 at twice the frequency, 2 n z a^2 of gravity;
    // by that share the tensions change, and the frequency by half of it.
    EXPECT_LE(std::abs(share_left(exact.Positions_m())),
              std::numbers::pi / 2 * kLinks * z * kSteepest_rad * kSteepest_rad);
  }
}

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Hanging);
DRAPE_PRESET_TEST_ON_EVERY_BACKEND(Modes);

}  // namespace
}  // namespace drape::test
