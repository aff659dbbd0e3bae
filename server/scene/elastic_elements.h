// Elements that resist bending and shear at any step size, and how they share the particles' masses
// (server/solver/method.md, "apply_elastic").
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/mesh.h"

namespace drape {

// How the normal of a hinge that is nearly folded flat fades, relative to that of a flat one:
// within about this angle [rad] from there. Larger: a rest angle of more than a right angle is less
// exact; smaller: forces there change more at once.
inline constexpr double kHingeBlur = 0.1;
inline constexpr double kHingeBlurSq = kHingeBlur * kHingeBlur;
// The normal of a flat hinge has the length 1 with it: sqrt(1 + kHingeBlurSq).
inline constexpr double kHingeNormalScale = 1.00498756211208903;
// Squared: what keeps hinges that have no edge from a division by 0 [m^4].
inline constexpr double kLeastHingeArea_m4 = 1e-24;

// The normal of a hinge, 1 long where it is flat: along `edge` x `across`, `across` the side
// towards its fourth particle less that towards the third, each over its height (equation 15a of
// server/solver/method.md).
inline Eigen::Vector3d HingeNormal(const Eigen::Vector3d& edge, const Eigen::Vector3d& across) {
  const Eigen::Vector3d normal = edge.cross(across);
  const double edge_sq = edge.squaredNorm();
  const double blur_sq = 4 * kHingeBlurSq * edge_sq * edge_sq + kLeastHingeArea_m4;
  return kHingeNormalScale / std::sqrt(normal.squaredNorm() + blur_sq) * normal;
}

// Stores stiffness / 2 |deflection|^2 for L = sum of weights[k] p[particles[k]], whose weights add
// up to 0: the deflection of a spring (the last two weights are 0) is |L| - rest_length, that of
// all others L - rest_length * HingeNormal. Places that an element does not need have weight 0 and
// the particle of the first place.
struct ElasticElement {
  std::array<uint32_t, 4> particles{};
  std::array<double, 4> weights{};
  double rest_length_m = 0;
  double stiffness_n_per_m = 0;  // > 0
  // 1, or 0 for no damping: share of the speed of l that an element loses if it is much too fast
  // for a substep. Linear elements need no damping, and where they are flat they have no direction
  // for it.
  double damping_share = 0;

  bool is_spring() const { return weights[2] == 0 && weights[3] == 0; }
  // Whether its impulses are along L.
  bool acts_along() const { return is_spring() || rest_length_m == 0; }
};

// Of the element with its particles at `position_of(particle)`, an Eigen::Vector3d [m].
template <class PositionOf>
double DeflectionOf_m(const ElasticElement& element, const PositionOf& position_of) {
  std::array<Eigen::Vector3d, 4> side;  // from the first particle, times the weight
  Eigen::Vector3d l = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < 4; ++k) {
    side[k] = position_of(element.particles[k]) - position_of(element.particles[0]);
    side[k] *= k == 1 ? 1 : element.weights[k];
    l += k == 1 ? element.weights[1] * side[1] : side[k];
  }
  if (element.is_spring()) return l.norm() - element.rest_length_m;
  return (l - element.rest_length_m * HingeNormal(side[1], side[2] - side[3])).norm();
}

// A spring.
ElasticElement ShearDiagonal(uint32_t i, uint32_t j, double length_m, double stiffness_n_per_m);

// Three particles in a row, `middle` between the others; `width_m` of a plate of rigidity B bends
// there: l is the turning angle times the spacing.
ElasticElement BendingRod(uint32_t before, uint32_t middle, uint32_t after, double spacing_m,
                          double width_m, double rigidity_n_m);

// The cell i j / k l of a plate of rigidity B and Poisson's ratio 0: 2 B / 2 times the square of
// its twist per area.
ElasticElement TwistCell(uint32_t i, uint32_t j, uint32_t k, uint32_t l, double area_m2,
                         double rigidity_n_m);

// The hinge between the triangles (i, j, k) and (i, j, l): l is twice the sine of half the angle
// between them times the length of the edge, as in the isometric bending model (Bergou et al. 2006,
// "A quadratic bending model for inextensible surfaces"), and the stiffness B over their area
// (exact on equilateral triangles; Seung and Nelson 1988). At rest where it is at `positions_m`.
ElasticElement Hinge(const std::array<uint32_t, 4>& ijkl,
                     std::span<const Eigen::Vector3d> positions_m, double rigidity_n_m);

// Where cloth is clamped, at the edge of what pins hold, rods and hinges bend on one side alone:
// the same angle on part of the area. Makes those elements stiffer accordingly.
void StiffenAtClamps(const std::vector<bool>& is_pin, std::vector<ElasticElement>& elements);

// An element as one of its particles sees it: the impulse that acts on the particle, times the
// weight.
struct ElasticEnd {
  uint32_t impulse = 0;  // of those of all elements, impulses_per_element of each
  double weight = 0;
};

// The elements of particle i are the entries offsets[i] .. offsets[i + 1] of `ends`, ascending.
struct ElasticShares {
  std::vector<uint32_t> offsets;  // [particle_count + 1]
  std::vector<ElasticEnd> ends;
  // One along L, or if any element does not act along it one on each of its four particles.
  uint32_t impulses_per_element = 1;
  // The frequency at which an element alone would oscillate with the shares of its particles'
  // masses that it claims [1/s^2], [element_count], and the mass of that oscillator [kg]: mass *
  // frequency_sq is the stiffness. No particle is claimed for more than its mass, so the motion of
  // a particle is the mean, by these shares, of the motions by its single elements.
  std::vector<double> frequencies_sq_per_s2;
  std::vector<double> masses_kg;
};

// Smallest mass of such an oscillator [kg]: small enough to have no effect, large enough for single
// precision.
inline constexpr double kMinElasticMass_kg = 1e-30;
inline constexpr double kMaxElasticFrequencySq_per_s2 = 1e18;  // far above any 1 / substep^2

// `inverse_masses_per_kg`: 0 for pins, which claim nothing. Linear time.
ElasticShares ShareElasticElements(std::span<const double> inverse_masses_per_kg,
                                   std::span<const ElasticElement> elements);

}  // namespace drape
