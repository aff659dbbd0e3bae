// Surfaces in states in which much of them is near itself.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/patch_search.h"
#include "server/solver/self_contact/search_budget.h"
#include "tests/support/scenes.h"

namespace drape::test {

inline self_contact::SearchBudget Unlimited() {
  return self_contact::SearchBudget(std::numeric_limits<size_t>::max());
}

// The particles of a sheet, pushed together along x until it has `folds` folds, of this height, and
// shaken by `noise_m`.
inline std::vector<self_contact::Vector3d> Folded(const SceneModel& model, double folds,
                                                  double shrink, double noise_m, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-noise_m, noise_m);
  std::vector<self_contact::Vector3d> positions;
  for (const Eigen::Vector3d& p : model.rest_positions_m()) {
    const double phase = 2 * M_PI * folds * p.x();
    positions.push_back(self_contact::Vector3d{
        shrink * p.x() + 0.1 * std::sin(2 * phase) / (1 + folds) + noise(random),
        (1 - shrink) / (1 + folds) * std::sin(phase) + noise(random), p.z() + noise(random), 0});
  }
  return positions;
}

template <class V>
std::vector<V> As(const std::vector<self_contact::Vector3d>& vectors) {
  std::vector<V> result;
  for (const auto& v : vectors) {
    result.push_back(self_contact::ToVector<V>(self_contact::FromVector(v)));
  }
  return result;
}

// Every pair of a vertex and a triangle or of two edges without a common vertex.
template <class Function>
void ForAllPairs(const ContactSurface& surface, const Function& function) {
  using self_contact::PairKind;
  for (const auto& triangle : surface.triangles()) {
    for (uint32_t i = 0; i < surface.particle_count(); ++i) {
      const auto& [j, k, l] = triangle;
      if (i != j && i != k && i != l) function(PairKind::kVertexTriangle, std::array{i, j, k, l});
    }
  }
  for (size_t a = 0; a < surface.edges().size(); ++a) {
    for (size_t b = a + 1; b < surface.edges().size(); ++b) {
      const auto& [i, j] = surface.edges()[a];
      const auto& [k, l] = surface.edges()[b];
      if (i != k && i != l && j != k && j != l) function(PairKind::kEdges, std::array{i, j, k, l});
    }
  }
}

// The patches that primitives belong to.
class PatchOwners {
 public:
  explicit PatchOwners(const ContactSurface& surface) {
    for (uint32_t p = 0; p < surface.patches().size(); ++p) {
      const ContactPatch& patch = surface.patches()[p];
      for (const uint32_t i : surface.vertices_of(patch)) owners_[{i}] = p;
      for (const uint32_t e : surface.edges_of(patch)) {
        owners_[{surface.edges()[e].begin(), surface.edges()[e].end()}] = p;
      }
      for (const uint32_t t : surface.triangles_of(patch)) {
        owners_[{surface.triangles()[t].begin(), surface.triangles()[t].end()}] = p;
      }
    }
  }
  // Of a pair of ForAllPairs.
  self_contact::PatchPair Of(self_contact::PairKind kind,
                             const std::array<uint32_t, 4>& particles) const {
    const auto middle = particles.begin() + self_contact::FirstCorners(kind);
    const auto [first, second] =
        std::minmax(owners_.at({particles.begin(), middle}), owners_.at({middle, particles.end()}));
    return {first, second};
  }

 private:
  std::map<std::vector<uint32_t>, uint32_t> owners_;
};

}  // namespace drape::test
