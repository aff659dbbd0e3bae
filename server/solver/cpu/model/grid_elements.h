// The elastic elements of a grid by rows and columns, for kicks row by row (stage `apply_elastic`).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape::cpu {

// A rod is at the particle in its middle, all others at the first particle of their cell.
enum class GridFamily : uint8_t {
  kRodsAlongRows,
  kRodsAlongColumns,
  kCells,
  // One of each cell: it falls, to the next row and column, where row + column is even; elsewhere
  // it rises, from the next column to the next row.
  kDiagonals,
};
inline constexpr size_t kGridFamilies = 4;

// Rows of elements that are kept at a time: the particles of a row need its own, that before and,
// of rods along columns, that after.
inline constexpr std::array<uint32_t, kGridFamilies> kKeptRows = {1, 3, 2, 2};
inline constexpr uint32_t kAllKeptRows = 8;
inline constexpr uint32_t kKeptPositions = 3;  // rows of positions
// Which of them has the elements of this row of a grid.
constexpr uint32_t KeptRow(GridFamily family, uint32_t row) {
  uint32_t begin = 0;
  for (size_t f = 0; f < static_cast<size_t>(family); ++f) begin += kKeptRows[f];
  return begin + row % kKeptRows[static_cast<size_t>(family)];
}

// Where the elements of a grid are. Constant after construction.
struct GridElements {
  explicit GridElements(const SceneModel& model);

  uint32_t columns = 0;
  uint32_t rows = 0;
  // Numbers from one row to the next: a multiple of eight, with at least one place after the last
  // column. 0: there is no grid, or it has no elements.
  uint32_t pitch = 0;
  bool has_bending = false;
  bool has_shear = false;
  // [family][rows * pitch] one more than the index of the element, 0 where there is none.
  std::array<std::vector<uint32_t>, kGridFamilies> elements;

  bool empty() const { return pitch == 0; }
  const std::vector<uint32_t>& Of(GridFamily family) const {
    return elements[static_cast<size_t>(family)];
  }
};

// What an element of mass M and squared frequency (ElasticShares) does in substeps h: equation (16)
// of server/solver/method.md without the time of the kick.
struct ElementStrength {
  ElementStrength() = default;
  ElementStrength(float mass, float frequency_sq, float damping_share, float h, float inverse_h,
                  float max_frequency_sq);

  float stiffness = 0;  // [N/m]
  float damping = 0;    // [N s/m]
};

// The numbers of the elements by their places, 0 where there is none.
struct GridStrengths {
  GridStrengths(const SceneModel& model, const GridElements& grid, float h, float inverse_h,
                float max_frequency_sq);

  std::array<std::vector<float>, kGridFamilies> stiffnesses;  // [family][rows * pitch] [N/m]
  std::array<std::vector<float>, kGridFamilies> dampings;     // only of diagonals [N s/m]
  std::vector<float> inverse_masses;                          // [rows * pitch] [1/kg]
  float rest_length = 0;                                      // of diagonals [m]

  const float* Stiffnesses(GridFamily family) const {
    return stiffnesses[static_cast<size_t>(family)].data();
  }
  const float* Dampings(GridFamily family) const {
    return dampings[static_cast<size_t>(family)].data();
  }
};

// The strengths of a model by the substep that they are made for, for as long as a cloth uses them.
// Any thread.
class GridStrengthsCache {
 public:
  std::shared_ptr<const GridStrengths> Get(const SceneModel& model, const GridElements& grid,
                                           float h, float inverse_h, float max_frequency_sq);

 private:
  std::mutex mutex_;
  std::map<std::array<float, 2>, std::weak_ptr<const GridStrengths>> made_;
};

}  // namespace drape::cpu
