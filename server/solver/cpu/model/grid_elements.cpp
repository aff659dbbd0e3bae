#include "server/solver/cpu/model/grid_elements.h"

#include <algorithm>

#include "server/solver/cpu/simd/numbers8.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

GridFamily FamilyOf(const ElasticElement& element, uint32_t columns) {
  const uint32_t first = element.particles[0], third = element.particles[2];
  if (element.weights[3] != 0) return GridFamily::kCells;
  if (element.weights[2] != 0) {
    const bool is_along_rows = columns > 1 && third - first == 1;
    return is_along_rows ? GridFamily::kRodsAlongRows : GridFamily::kRodsAlongColumns;
  }
  return GridFamily::kDiagonals;
}

// The particle that the element is at.
uint32_t PlaceOf(const ElasticElement& element, GridFamily family, uint32_t columns) {
  const uint32_t first = element.particles[0];
  const bool rises =
      family == GridFamily::kDiagonals && element.particles[1] - first == columns - 1;
  return rises ? first - 1 : first;
}

}  // namespace

GridElements::GridElements(const SceneModel& model)
    : columns(model.grid_columns()), rows(model.grid_rows()) {
  if (columns == 0 || model.elastic_elements().empty()) return;
  pitch = columns / kVec8Size * kVec8Size + kVec8Size;
  for (std::vector<uint32_t>& family : elements) family.assign(size_t{rows} * pitch, 0);
  for (uint32_t e = 0; e < model.elastic_count(); ++e) {
    const ElasticElement& element = model.elastic_elements()[e];
    const GridFamily family = FamilyOf(element, columns);
    (family == GridFamily::kDiagonals ? has_shear : has_bending) = true;
    const uint32_t place = PlaceOf(element, family, columns);
    const uint32_t row = place / columns, column = place % columns;
    elements[static_cast<size_t>(family)][size_t{row} * pitch + column] = e + 1;
  }
}

ElementStrength::ElementStrength(float mass, float frequency_sq, float damping_share, float h,
                                 float inverse_h, float max_frequency_sq)
    : stiffness(mass * std::min(frequency_sq, max_frequency_sq)) {
  const float ratio = std::min(frequency_sq * (h * h), static_cast<float>(kMaxElasticRatio));
  const float ratio_sq = ratio * ratio;
  damping = mass * (damping_share * ratio_sq / (1 + ratio_sq) * inverse_h);
}

GridStrengths::GridStrengths(const SceneModel& model, const GridElements& grid, float h,
                             float inverse_h, float max_frequency_sq)
    : inverse_masses(size_t{grid.rows} * grid.pitch, 0.0f) {
  const ElasticShares& shares = model.elastic_shares();
  for (size_t f = 0; f < kGridFamilies; ++f) {
    const std::vector<uint32_t>& elements = grid.elements[f];
    stiffnesses[f].assign(elements.size(), 0.0f);
    dampings[f].assign(elements.size(), 0.0f);
    for (size_t place = 0; place < elements.size(); ++place) {
      if (elements[place] == 0) continue;
      const uint32_t e = elements[place] - 1;
      const ElementStrength strength(static_cast<float>(shares.masses_kg[e]),
                                     static_cast<float>(shares.frequencies_sq_per_s2[e]),
                                     static_cast<float>(model.elastic_elements()[e].damping_share),
                                     h, inverse_h, max_frequency_sq);
      stiffnesses[f][place] = strength.stiffness;
      dampings[f][place] = strength.damping;
      if (static_cast<GridFamily>(f) == GridFamily::kDiagonals) {
        rest_length = static_cast<float>(model.elastic_elements()[e].rest_length_m);
      }
    }
  }
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    inverse_masses[size_t{i / grid.columns} * grid.pitch + i % grid.columns] =
        static_cast<float>(model.inverse_masses_per_kg()[i]);
  }
}

std::shared_ptr<const GridStrengths> GridStrengthsCache::Get(const SceneModel& model,
                                                             const GridElements& grid, float h,
                                                             float inverse_h,
                                                             float max_frequency_sq) {
  const std::lock_guard lock(mutex_);
  const std::array<float, 2> key = {h, max_frequency_sq};
  if (auto found = made_[key].lock()) return found;
  auto made = std::make_shared<const GridStrengths>(model, grid, h, inverse_h, max_frequency_sq);
  std::erase_if(made_, [](const auto& item) { return item.second.expired(); });
  made_[key] = made;
  return made;
}

}  // namespace drape::cpu
