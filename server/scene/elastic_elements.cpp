#include "server/scene/elastic_elements.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drape {

namespace {

using Eigen::Vector3d;

// Claims of one element on its particles, up to a common factor: the row of its |stiffness matrix|.
double Claim(const ElasticElement& element, size_t place, std::span<const double> w) {
  double free_weights = 0;
  for (size_t k = 0; k < 4; ++k) {
    if (w[element.particles[k]] > 0) free_weights += std::abs(element.weights[k]);
  }
  return element.stiffness_n_per_m * std::abs(element.weights[place]) * free_weights;
}

void GatherEnds(std::span<const ElasticElement> elements, size_t particle_count,
                ElasticShares& shares) {
  shares.offsets.assign(particle_count + 1, 0);
  for (const ElasticElement& element : elements) {
    for (size_t k = 0; k < 4; ++k) {
      if (element.weights[k] != 0) ++shares.offsets[element.particles[k] + 1];
    }
  }
  std::partial_sum(shares.offsets.begin(), shares.offsets.end(), shares.offsets.begin());
  shares.ends.resize(shares.offsets.back());
  if (!std::ranges::all_of(elements, &ElasticElement::acts_along)) shares.impulses_per_element = 4;
  std::vector<uint32_t> next(shares.offsets.begin(), shares.offsets.end() - 1);
  for (uint32_t e = 0; e < elements.size(); ++e) {
    for (size_t k = 0; k < 4; ++k) {
      const double weight = elements[e].weights[k];
      if (weight == 0) continue;
      shares.ends[next[elements[e].particles[k]]++] =
          shares.impulses_per_element == 1 ? ElasticEnd{e, weight}
                                           : ElasticEnd{4 * e + static_cast<uint32_t>(k), 1};
    }
  }
}

}  // namespace

ElasticElement ShearDiagonal(uint32_t i, uint32_t j, double length_m, double stiffness_n_per_m) {
  return {.particles = {i, j, i, i},
          .weights = {-1, 1, 0, 0},
          .rest_length_m = length_m,
          .stiffness_n_per_m = stiffness_n_per_m,
          .damping_share = 1};
}

ElasticElement BendingRod(uint32_t before, uint32_t middle, uint32_t after, double spacing_m,
                          double width_m, double rigidity_n_m) {
  // B width / spacing times the square of the angle.
  return {.particles = {middle, before, after, middle},
          .weights = {-2, 1, 1, 0},
          .rest_length_m = 0,
          .stiffness_n_per_m = rigidity_n_m * width_m / (spacing_m * spacing_m * spacing_m)};
}

ElasticElement TwistCell(uint32_t i, uint32_t j, uint32_t k, uint32_t l, double area_m2,
                         double rigidity_n_m) {
  return {.particles = {i, j, k, l},
          .weights = {1, -1, -1, 1},
          .rest_length_m = 0,
          .stiffness_n_per_m = 2 * rigidity_n_m / area_m2};
}

ElasticElement Hinge(const std::array<uint32_t, 4>& ijkl, std::span<const Vector3d> positions_m,
                     double rigidity_n_m) {
  const auto& [i, j, k, l] = ijkl;
  const Vector3d edge = positions_m[j] - positions_m[i];
  ElasticElement hinge{.particles = ijkl};
  double area_m2 = 0;
  // Each triangle adds the edge's length times its outward conormal there: the foot of the height
  // less the apex, over the height, all in the plane of the triangle.
  for (const size_t place : {size_t{2}, size_t{3}}) {
    const Vector3d side = positions_m[ijkl[place]] - positions_m[i];
    const double triangle_m2 = edge.cross(side).norm() / 2;
    const double length_over_height = edge.squaredNorm() / (2 * triangle_m2);
    const double foot = side.dot(edge) / edge.squaredNorm();  // from i to j
    hinge.weights[0] += length_over_height * (1 - foot);
    hinge.weights[1] += length_over_height * foot;
    hinge.weights[place] = -length_over_height;
    area_m2 += triangle_m2;
  }
  hinge.stiffness_n_per_m = rigidity_n_m / area_m2;
  Vector3d l_m = Vector3d::Zero();
  for (size_t place = 1; place < 4; ++place) {
    l_m += hinge.weights[place] * (positions_m[ijkl[place]] - positions_m[i]);
  }
  const Vector3d normal =
      HingeNormal(edge, hinge.weights[2] * (positions_m[k] - positions_m[i]) -
                            hinge.weights[3] * (positions_m[l] - positions_m[i]));
  hinge.rest_length_m = l_m.dot(normal) / normal.squaredNorm();
  return hinge;
}

void StiffenAtClamps(const std::vector<bool>& is_pin, std::vector<ElasticElement>& elements) {
  for (ElasticElement& element : elements) {
    const auto& [particles, weights, rest_length, stiffness, damping] = element;
    const bool is_rod = weights[2] != 0 && weights[3] == 0;
    // The sides of a rod are its second and third particle, those of a hinge its third and fourth.
    // The weight at a side is as the reciprocal of its area.
    const size_t side = is_rod ? 1 : 2;
    const bool is_axis_held = is_pin[particles[0]] && (is_rod || is_pin[particles[1]]);
    const bool is_bending = is_rod || (weights[3] != 0 && weights[2] * weights[3] > 0);
    if (!is_bending || !is_axis_held) continue;
    if (is_pin[particles[side]] == is_pin[particles[side + 1]]) continue;
    const size_t held = is_pin[particles[side]] ? side : side + 1;
    const size_t free = 2 * side + 1 - held;
    element.stiffness_n_per_m *= 1 + weights[free] / weights[held];
  }
}

ElasticShares ShareElasticElements(std::span<const double> inverse_masses_per_kg,
                                   std::span<const ElasticElement> elements) {
  const std::span<const double> w = inverse_masses_per_kg;
  ElasticShares shares;
  GatherEnds(elements, w.size(), shares);
  std::vector<double> claims(w.size(), 0.0);
  for (const ElasticElement& element : elements) {
    for (size_t k = 0; k < 4; ++k) claims[element.particles[k]] += Claim(element, k, w);
  }
  for (const ElasticElement& element : elements) {
    double inverse_mass = 0;  // of L, with the shares: weight^2 over the share
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t i = element.particles[k];
      if (w[i] == 0 || element.weights[k] == 0) continue;
      const double share = Claim(element, k, w) / claims[i];
      inverse_mass += element.weights[k] * element.weights[k] * w[i] / share;
    }
    const double mass_kg = std::max(1 / inverse_mass, kMinElasticMass_kg);
    shares.masses_kg.push_back(mass_kg);
    shares.frequencies_sq_per_s2.push_back(
        std::min(element.stiffness_n_per_m / mass_kg, kMaxElasticFrequencySq_per_s2));
  }
  return shares;
}

}  // namespace drape
