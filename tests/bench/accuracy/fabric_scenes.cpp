#include "tests/bench/accuracy/fabric_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "tests/support/elastica.h"
#include "tests/support/garments.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

struct Fabric {
  std::string name;
  StructuralMaterial material;
};

StructuralMaterial Material(double density_kg_per_m2, double rigidity_n_m, double shear_n_per_m) {
  return {.areal_density_kg_per_m2 = density_kg_per_m2,
          .bending_rigidity_n_m = rigidity_n_m,
          .shear_modulus_n_per_m = shear_n_per_m};
}

// client/examples/fabrics.md; card of 0.3 mm.
const std::vector<Fabric>& Fabrics() {
  static const std::vector<Fabric> fabrics = {{"cotton", Material(0.12, 1e-5, 40)},
                                              {"denim", Material(0.4, 2e-4, 100)},
                                              {"silk", Material(0.08, 3e-6, 10)},
                                              {"card", Material(0.3, 0.02, 1000)}};
  return fabrics;
}

double MeanHeight_m(const SceneModel& model, const std::vector<Vector3d>& positions_m) {
  double moment = 0, mass = 0;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    moment += model.masses_kg()[i] * positions_m[i].y();
    mass += model.masses_kg()[i];
  }
  return moment / mass;
}

// `load` = w L^3 / B, w the weight per area and B the rigidity: 1 bends a little, 20 a lot. The
// second line of particles is the end of the clamp.
QuantityScene Cantilever(const Fabric& fabric, uint32_t cells, double load, double duration_s) {
  const StructuralMaterial& material = fabric.material;
  const double weight_n_per_m2 =
      material.areal_density_kg_per_m2 * ClothParameters().gravity_m_per_s2.norm();
  const double overhang_m = std::cbrt(load * material.bending_rigidity_n_m / weight_n_per_m2);
  const double cell_m = overhang_m / cells;
  const uint32_t columns = cells + 2;
  test::Scene scene =
      test::Grid(columns, 3, cell_m * (cells + 1), 2 * cell_m,
                 {0, 1, columns, columns + 1, 2 * columns, 2 * columns + 1}, material);
  scene.parameters.damping_per_s = 4;
  const double expected_m =
      test::ElasticaDrop_m(overhang_m, material.bending_rigidity_n_m, weight_n_per_m2);
  return {.name = fabric.name + " load " + std::to_string(std::lround(load)) + " cells " +
                  std::to_string(cells),
          .scene = std::move(scene),
          .duration_s = duration_s,
          .quantities = {
              {"drop of the end", "m",
               [end = 2 * columns - 1](auto states) { return -states.back().positions_m[end].y(); },
               expected_m}}};
}

// The same strip as an irregular mesh.
QuantityScene MeshCantilever(const Fabric& fabric, uint32_t cells, double load, double duration_s) {
  StructuralMaterial material = fabric.material;
  material.shear_modulus_n_per_m = 0;
  material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  const double weight_n_per_m2 =
      material.areal_density_kg_per_m2 * ClothParameters().gravity_m_per_s2.norm();
  const double overhang_m = std::cbrt(load * material.bending_rigidity_n_m / weight_n_per_m2);
  test::Scene scene = test::ClampedStrip(cells, overhang_m / cells, material, cells);
  const uint32_t columns = cells + 2;
  const auto mean_drop_m = [columns](auto states) {
    double sum_m = 0;
    for (uint32_t row = 0; row < 5; ++row) {
      sum_m -= states.back().positions_m[(row + 1) * columns - 1].y();
    }
    return sum_m / 5;
  };
  return {.name = fabric.name + " mesh load " + std::to_string(std::lround(load)) + " cells " +
                  std::to_string(cells),
          .scene = std::move(scene),
          .duration_s = duration_s,
          .is_slow = true,
          .quantities = {
              {"drop of the end", "m", mean_drop_m,
               test::ElasticaDrop_m(overhang_m, material.bending_rigidity_n_m, weight_n_per_m2)}}};
}

// |strain| of the links, ascending.
std::vector<double> Strains(const SceneModel& model, const std::vector<Vector3d>& positions_m) {
  std::vector<double> strains;
  for (const DistanceConstraint& link : model.constraints()) {
    const double length_m = (positions_m[link.i] - positions_m[link.j]).norm();
    strains.push_back(std::abs(length_m / link.rest_length_m - 1));
  }
  std::sort(strains.begin(), strains.end());
  return strains;
}

// By nearest rank.
Quantity StrainQuantity(const std::string& name, std::shared_ptr<const SceneModel> model,
                        double percent) {
  return {name, "-",
          [model = std::move(model), percent](auto states) {
            const std::vector<double> strains = Strains(*model, states.back().positions_m);
            const double rank = std::ceil(static_cast<double>(strains.size()) * percent / 100);
            return strains[static_cast<size_t>(rank) - 1];
          },
          0};
}

constexpr double kTableRadius_m = 0.09;
constexpr double kSquare_m = 0.3;

bool IsInTriangle(double x, double z, const Vector3d (&corners)[3]) {
  int positive = 0, negative = 0;
  for (int k = 0; k < 3; ++k) {
    const Vector3d &a = corners[k], &b = corners[(k + 1) % 3];
    const double side = (b.x() - a.x()) * (z - a.z()) - (b.z() - a.z()) * (x - a.x());
    (side < 0 ? negative : positive) += 1;
  }
  return positive == 0 || negative == 0;
}

// Area of the shadow from above, by squares of half a millimetre [m^2].
double ShadowArea_m2(const SceneModel& model, const std::vector<Vector3d>& positions_m) {
  constexpr double kPixel_m = 5e-4;
  constexpr int kPixels = 1024;  // a side; the sheet is about its middle
  constexpr double kBegin_m = (kSquare_m - kPixels * kPixel_m) / 2;
  std::vector<bool> is_dark(kPixels * kPixels, false);
  const auto pixel = [](double x) {
    return std::clamp(static_cast<int>(std::floor((x - kBegin_m) / kPixel_m)), 0, kPixels - 1);
  };
  for (const auto& triangle : model.triangles()) {
    const Vector3d corners[3] = {positions_m[triangle[0]], positions_m[triangle[1]],
                                 positions_m[triangle[2]]};
    const auto [low_x, high_x] = std::minmax({corners[0].x(), corners[1].x(), corners[2].x()});
    const auto [low_z, high_z] = std::minmax({corners[0].z(), corners[1].z(), corners[2].z()});
    for (int row = pixel(low_z); row <= pixel(high_z); ++row) {
      for (int column = pixel(low_x); column <= pixel(high_x); ++column) {
        const double x = kBegin_m + (column + 0.5) * kPixel_m;
        const double z = kBegin_m + (row + 0.5) * kPixel_m;
        if (IsInTriangle(x, z, corners)) {
          is_dark[static_cast<size_t>(row * kPixels + column)] = true;
        }
      }
    }
  }
  return static_cast<double>(std::count(is_dark.begin(), is_dark.end(), true)) * kPixel_m *
         kPixel_m;
}

double DrapeCoefficient(const SceneModel& model, const std::vector<Vector3d>& positions_m) {
  const double table_m2 = std::numbers::pi * kTableRadius_m * kTableRadius_m;
  return (ShadowArea_m2(model, positions_m) - table_m2) / (kSquare_m * kSquare_m - table_m2);
}

QuantityScene Draped(const std::string& fabric, test::Scene scene, std::optional<double> expected,
                     double duration_s) {
  const double middle_m = kSquare_m / 2;
  ClothParameters& parameters = scene.parameters;
  parameters.colliders = {
      CylinderBetween({middle_m, -0.5, middle_m}, {middle_m, -0.001, middle_m}, kTableRadius_m)};
  parameters.thickness_m = 0.001;
  parameters.friction_static = 0.5;
  parameters.friction_dynamic = 0.4;
  parameters.damping_per_s = 2;
  const auto model = scene.model;
  return {.name = fabric + " " + scene.name,
          .scene = scene,
          .duration_s = duration_s,
          .is_slow = model->particle_count() > 256,
          .quantities = {
              {"drape coefficient of " + fabric, "-",
               [model](auto states) { return DrapeCoefficient(*model, states.back().positions_m); },
               expected}}};
}

// The angle from one link to the next at which `links` of them, of 1 m together, go round from one
// end to another `chord_m` away.
double CornerOfArc(uint32_t links, double chord_m) {
  double low = 0, high = std::numbers::pi / links;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    const double chord = std::sin(links * middle / 2) / (links * std::sin(middle / 2));
    (chord > chord_m ? low : high) = middle;
  }
  return low;
}

// Its corners are nearer to each other than it is wide: a first row that is taut cannot sag. It
// starts upright, bent round a vertical axis, every link as long as at rest.
QuantityScene Sagging(uint32_t side, double time_step_s, double duration_s) {
  constexpr double kChord_m = 0.9;
  const Fabric& cotton = Fabrics()[0];
  test::Scene scene = test::Grid(side, side, 1, 1, {0, side - 1}, cotton.material);
  const double corner_rad = CornerOfArc(side - 1, kChord_m);
  const double radius_m = 0.5 / ((side - 1) * std::sin(corner_rad / 2));
  for (uint32_t i = 0; i < side * side; ++i) {
    const double angle_rad = corner_rad * (i % side - (side - 1) / 2.0);
    scene.state.positions_m[i] = {radius_m * std::sin(angle_rad), -scene.state.positions_m[i].z(),
                                  radius_m * std::cos(angle_rad)};
  }
  scene.parameters.damping_per_s = 2;
  const auto model = scene.model;
  // Without a particle in the middle of the row, the two beside it are as high as each other.
  return {.name = std::to_string(side) + " x " + std::to_string(side) + " at 1/" +
                  std::to_string(std::lround(1 / time_step_s)) + " s",
          .scene = std::move(scene),
          .duration_s = duration_s,
          .time_step_s = time_step_s,
          .is_slow = side > 32,
          .quantities = {{"sag of the first row", "m",
                          [side](auto states) { return -states.back().positions_m[side / 2].y(); }},
                         {"depth of the middle of mass", "m", [model](auto states) {
                            return -MeanHeight_m(*model, states.back().positions_m);
                          }}}};
}

}  // namespace

std::vector<QuantityScene> CantileverScenes(bool is_quick) {
  if (is_quick) return {Cantilever(Fabrics()[3], 8, 5, 0.1)};
  std::vector<QuantityScene> scenes;
  for (const Fabric& fabric : Fabrics()) {
    for (const double load : {1.0, 5.0, 20.0}) {
      for (const uint32_t cells : {8u, 16u, 32u}) {
        scenes.push_back(Cantilever(fabric, cells, load, 5));
      }
    }
    for (const uint32_t cells : {8u, 16u, 32u}) {
      scenes.push_back(MeshCantilever(fabric, cells, 5, 5));
    }
  }
  return scenes;
}

std::vector<QuantityScene> GarmentScenes(bool is_quick) {
  std::vector<QuantityScene> scenes;
  for (const uint32_t seed : {1u, 2u, 3u}) {
    for (const double cell_m : {0.05, 0.03}) {
      test::GarmentOptions options{.seed = seed, .cell_m = is_quick ? 0.2 : cell_m};
      if (seed == 3) {  // bends, turned and far from the origin
        options.bending_rigidity_n_m = 1e-5;
        options.transform.position_m = {20, 5, -30};
        options.transform.rotation = Eigen::AngleAxisd(0.4, Vector3d(0.3, 0.5, 0.8).normalized());
      }
      for (test::Scene& scene : test::Garments(options)) {
        const auto model = scene.model;
        scenes.push_back({.name = scene.name + " " + std::to_string(seed) + " of " +
                                  std::to_string(model->particle_count()) + " vertices",
                          .scene = std::move(scene),
                          .duration_s = is_quick ? 0.1 : 5,
                          .is_slow = true,
                          .quantities = {StrainQuantity("strain p50", model, 50),
                                         StrainQuantity("strain p90", model, 90),
                                         StrainQuantity("strain p99", model, 99),
                                         StrainQuantity("strain max", model, 100)}});
        if (is_quick) return scenes;
      }
    }
  }
  return scenes;
}

std::vector<QuantityScene> DrapeScenes(bool is_quick) {
  constexpr double kDuration_s = 6;
  const auto grid = [](const StructuralMaterial& material, uint32_t side) {
    return test::Grid(side, side, kSquare_m, kSquare_m, {}, material);
  };
  // Woven, with threads along the sides.
  const auto mesh = [](StructuralMaterial material, uint32_t side) {
    material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
    return test::MeshedGrid(side, side, kSquare_m, kSquare_m, {}, material);
  };
  const StructuralMaterial board = Material(0.4, 1, 1000);
  if (is_quick) return {Draped("board", grid(board, 8), 1, 0.1)};
  std::vector<QuantityScene> scenes = {Draped("board", grid(board, 16), 1, kDuration_s),
                                       Draped("board", mesh(board, 16), 1, kDuration_s)};
  for (const Fabric& fabric : Fabrics()) {
    for (const uint32_t side : {61u, 31u, 16u}) {
      const std::string name = fabric.name + " in " + std::to_string(side - 1) + " cells";
      scenes.push_back(Draped(name, grid(fabric.material, side), {}, kDuration_s));
      scenes.push_back(Draped(name, mesh(fabric.material, side), {}, kDuration_s));
    }
  }
  return scenes;
}

std::vector<QuantityScene> SagScenesBySide(bool is_quick) {
  if (is_quick) return {Sagging(8, kFrame_s, 0.1), Sagging(4, kFrame_s, 0.1)};
  std::vector<QuantityScene> scenes;
  for (const uint32_t side : {128u, 64u, 32u, 16u}) scenes.push_back(Sagging(side, kFrame_s, 8));
  return scenes;
}

std::vector<QuantityScene> SagScenesByStep(bool is_quick) {
  if (is_quick) return {Sagging(4, kFrame_s / 2, 0.1), Sagging(4, kFrame_s, 0.1)};
  std::vector<QuantityScene> scenes;
  for (const double per_s : {240.0, 120.0, 60.0, 30.0}) {
    scenes.push_back(Sagging(32, 1 / per_s, 8));
  }
  return scenes;
}

}  // namespace drape::bench
