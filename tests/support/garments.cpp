#include "tests/support/garments.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>

namespace drape::test {
namespace {

using Eigen::Vector3d;

// Numbers by a seed, the same on every machine.
class Numbers {
 public:
  explicit Numbers(uint32_t seed) : engine_(seed) {}
  // In [-limit, limit].
  double Within(double limit) { return limit * (static_cast<double>(engine_()) / 0x1p31 - 1); }
  bool Bit() { return engine_() >> 31 != 0; }

 private:
  std::mt19937 engine_;
};

constexpr double kShake = 0.3;  // of a cell: how far a vertex is off its place

// A patch of cells of which the vertices may be others' (sewn) and cells may be left out.
struct Patch {
  uint32_t columns = 0;  // of vertices; rings: the last is beside the first
  uint32_t rows = 0;
  bool is_ring = false;
  std::function<Vector3d(double column, double row)> place = {};
  std::function<bool(uint32_t column, uint32_t row)> has_cell = {};  // unset: all
};

class GarmentMesh {
 public:
  explicit GarmentMesh(uint32_t seed) : numbers_(seed) {}

  // Vertices of a patch row by row. The first row is `sewn` if there is one.
  std::vector<uint32_t> Add(const Patch& patch, std::vector<uint32_t> sewn = {}) {
    std::vector<uint32_t> vertices = std::move(sewn);
    const bool is_sewn = !vertices.empty();
    for (uint32_t row = is_sewn ? 1 : 0; row < patch.rows; ++row) {
      for (uint32_t column = 0; column < patch.columns; ++column) {
        const bool is_rim_row = row == 0 || row + 1 == patch.rows;
        const bool is_rim_column = !patch.is_ring && (column == 0 || column + 1 == patch.columns);
        const double off_column = is_rim_column ? 0 : numbers_.Within(kShake);
        const double off_row = is_rim_row ? 0 : numbers_.Within(kShake);
        vertices.push_back(static_cast<uint32_t>(mesh_.positions_m.size()));
        mesh_.positions_m.push_back(patch.place(column + off_column, row + off_row));
      }
    }
    AddCells(patch, vertices);
    return vertices;
  }

  Scene Hang(const std::string& name, const std::vector<uint32_t>& pins,
             const GarmentOptions& options) {
    for (Vector3d& position : mesh_.positions_m) position = options.transform * position;
    return Hang(name, pins,
                StructuralMaterial{.areal_density_kg_per_m2 = options.areal_density_kg_per_m2,
                                   .stretch_stiffness_n_per_m = options.stretch_stiffness_n_per_m,
                                   .bending_rigidity_n_m = options.bending_rigidity_n_m});
  }
  Scene Hang(const std::string& name, const std::vector<uint32_t>& pins,
             const StructuralMaterial& material) {
    DropUnused();
    ModelDescription description{.topology = mesh_, .material = material, .pinned_particles = {}};
    for (const uint32_t pin : pins) description.pinned_particles.push_back(new_index_[pin]);
    Scene scene;
    scene.name = name;
    scene.model = BuildModel(description);
    scene.state = RestState(*scene.model);
    scene.parameters.settings = PresetSettings(Preset::kRealtime);
    scene.parameters.damping_per_s = 2;
    return scene;
  }

 private:
  void AddCells(const Patch& patch, const std::vector<uint32_t>& vertices) {
    const uint32_t cells = patch.is_ring ? patch.columns : patch.columns - 1;
    for (uint32_t row = 0; row + 1 < patch.rows; ++row) {
      for (uint32_t column = 0; column < cells; ++column) {
        const bool is_falling = numbers_.Bit();
        if (patch.has_cell && !patch.has_cell(column, row)) continue;
        const uint32_t next = (column + 1) % patch.columns;
        const uint32_t a = vertices[row * patch.columns + column];
        const uint32_t b = vertices[row * patch.columns + next];
        const uint32_t c = vertices[(row + 1) * patch.columns + column];
        const uint32_t d = vertices[(row + 1) * patch.columns + next];
        if (is_falling) {
          mesh_.triangles.push_back({a, c, d});
          mesh_.triangles.push_back({a, d, b});
        } else {
          mesh_.triangles.push_back({a, c, b});
          mesh_.triangles.push_back({b, c, d});
        }
      }
    }
  }

  // Vertices inside holes.
  void DropUnused() {
    std::vector<bool> is_used(mesh_.positions_m.size(), false);
    for (const auto& triangle : mesh_.triangles) {
      for (const uint32_t corner : triangle) is_used[corner] = true;
    }
    std::vector<Vector3d> positions;
    new_index_.assign(is_used.size(), 0);
    for (size_t i = 0; i < is_used.size(); ++i) {
      new_index_[i] = static_cast<uint32_t>(positions.size());
      if (is_used[i]) positions.push_back(mesh_.positions_m[i]);
    }
    for (auto& triangle : mesh_.triangles) {
      for (uint32_t& corner : triangle) corner = new_index_[corner];
    }
    mesh_.positions_m = std::move(positions);
  }

  Numbers numbers_;
  TriangleMesh mesh_;
  std::vector<uint32_t> new_index_;  // [vertex]
};

uint32_t CellsOf(double length_m, const GarmentOptions& options) {
  return std::max(4u, static_cast<uint32_t>(std::lround(length_m / options.cell_m)));
}

std::vector<uint32_t> Iota(uint32_t count) {
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < count; ++i) indices.push_back(i);
  return indices;
}

// The vertices around a square hole of `cells` a side, from its upper left corner along the upper
// edge, down, back and up.
std::vector<uint32_t> RimOfHole(const std::vector<uint32_t>& vertices, uint32_t columns,
                                uint32_t column, uint32_t row, uint32_t cells) {
  std::vector<uint32_t> rim;
  const auto add = [&](uint32_t c, uint32_t r) {
    rim.push_back(vertices[(row + r) * columns + (column + c) % columns]);
  };
  for (uint32_t k = 0; k < cells; ++k) add(k, 0);
  for (uint32_t k = 0; k < cells; ++k) add(cells, k);
  for (uint32_t k = cells; k > 0; --k) add(k, cells);
  for (uint32_t k = cells; k > 0; --k) add(0, k);
  return rim;
}

Scene SheetBy(bool is_hung, const GarmentOptions& options) {
  const uint32_t side = CellsOf(1, options) + 1;
  GarmentMesh mesh(options.seed);
  mesh.Add({.columns = side, .rows = side, .place = [&](double column, double row) {
              return Vector3d(column / (side - 1), 0, row / (side - 1));
            }});
  const std::vector<uint32_t> corners{0, side - 1};
  return mesh.Hang("sheet", is_hung ? corners : std::vector<uint32_t>{}, options);
}

}  // namespace

Scene IrregularSheet(const GarmentOptions& options) {
  return SheetBy(true, options);
}

Scene LooseIrregularSheet(const GarmentOptions& options) {
  return SheetBy(false, options);
}

Scene Shirt(const GarmentOptions& options) {
  constexpr double kRadius_m = 0.25, kHeight_m = 0.7, kSleeve_m = 0.4, kArmhole_m = 0.2;
  const uint32_t hole = CellsOf(kArmhole_m, options), top = 2;
  // However coarse: cells around the holes.
  const uint32_t around =
      std::max(CellsOf(2 * std::numbers::pi * kRadius_m, options) / 2 * 2, 2 * (hole + 2));
  const uint32_t rows = std::max(CellsOf(kHeight_m, options) + 1, top + hole + 3);
  const uint32_t left = 0, right = around / 2;
  const auto is_in_hole = [&](uint32_t column, uint32_t row) {
    const auto is_in = [&](uint32_t first) { return (column + around - first) % around < hole; };
    return row >= top && row < top + hole && (is_in(left) || is_in(right));
  };
  GarmentMesh mesh(options.seed);
  const std::vector<uint32_t> body = mesh.Add(
      {.columns = around,
       .rows = rows,
       .is_ring = true,
       .place =
           [&](double column, double row) {
             const double angle = 2 * std::numbers::pi * column / around;
             return Vector3d(kRadius_m * std::cos(angle), -kHeight_m * row / (rows - 1),
                             kRadius_m * std::sin(angle));
           },
       .has_cell = [&](uint32_t column, uint32_t row) { return !is_in_hole(column, row); }});
  for (const uint32_t first : {left, right}) {
    const std::vector<uint32_t> rim = RimOfHole(body, around, first, top, hole);
    const double middle = 2 * std::numbers::pi * (first + hole / 2.0) / around;
    const Vector3d out(std::cos(middle), 0, std::sin(middle)), side(-out.z(), 0, out.x());
    const double depth_m = kHeight_m * (top + hole / 2.0) / (rows - 1);
    const double sleeve_radius_m = 4 * hole * options.cell_m / (2 * std::numbers::pi);
    const auto count = static_cast<uint32_t>(rim.size());
    mesh.Add({.columns = count,
              .rows = CellsOf(kSleeve_m, options) + 1,
              .is_ring = true,
              .place =
                  [&](double column, double row) {
                    // The rim begins at its upper left corner, an eighth of a turn from the top.
                    const double angle = 2 * std::numbers::pi * (column / count - 0.125);
                    const Vector3d across = sleeve_radius_m * (std::sin(angle) * side +
                                                               std::cos(angle) * Vector3d::UnitY());
                    return Vector3d((kRadius_m + options.cell_m * row) * out -
                                    depth_m * Vector3d::UnitY() + across);
                  }},
             rim);
  }
  return mesh.Hang("shirt", Iota(around), options);
}

Scene Dress(const GarmentOptions& options) {
  constexpr double kHeight_m = 0.9, kWaist_m = 0.12, kWaistDepth_m = 0.25;
  const uint32_t around = CellsOf(2 * std::numbers::pi * 0.2, options);
  const uint32_t rows = CellsOf(kHeight_m, options) + 1;
  // The dart is a wedge of the ring, widest at the waist, whose angle the others share.
  const auto radius_m = [](double depth_m) {
    const double from_waist_m = depth_m - kWaistDepth_m;
    return kWaist_m + (from_waist_m < 0 ? 0.25 : 0.35) * std::abs(from_waist_m);
  };
  GarmentMesh mesh(options.seed);
  mesh.Add(
      {.columns = around, .rows = rows, .is_ring = true, .place = [&](double column, double row) {
         const double depth_m = kHeight_m * row / (rows - 1);
         const double dart = 0.4 * std::exp(-std::pow((depth_m - kWaistDepth_m) / 0.08, 2));
         const double turn = 2 * std::numbers::pi * column / around;
         // Columns crowd at the dart, in front.
         const double angle = turn - dart * std::sin(turn);
         return Vector3d(radius_m(depth_m) * std::cos(angle), -depth_m,
                         radius_m(depth_m) * std::sin(angle));
       }});
  return mesh.Hang("dress", Iota(around), options);
}

Scene ClampedStrip(uint32_t cells, double cell_m, const StructuralMaterial& material,
                   uint32_t seed) {
  constexpr uint32_t kRows = 5;
  const uint32_t columns = cells + 2;
  GarmentMesh mesh(seed);
  mesh.Add({.columns = columns, .rows = kRows, .place = [&](double column, double row) {
              // The clamp ends in a straight line.
              const double x = column < 1.5 ? std::round(column) : column;
              return Vector3d(cell_m * x, 0, cell_m * row);
            }});
  std::vector<uint32_t> pins;
  for (uint32_t row = 0; row < kRows; ++row) {
    pins.push_back(row * columns);
    pins.push_back(row * columns + 1);
  }
  Scene scene = mesh.Hang("strip", pins, material);
  scene.parameters.damping_per_s = 4;
  return scene;
}

std::vector<Scene> Garments(const GarmentOptions& options) {
  return {IrregularSheet(options), Shirt(options), Dress(options)};
}

}  // namespace drape::test
