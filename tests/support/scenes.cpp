#include "tests/support/scenes.h"

#include <cmath>
#include <utility>

#include "server/core/check.h"
#include "server/scene/distance_map.h"
#include "tests/support/solids/solids.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

Scene MakeScene(std::string name, const ModelDescription& description) {
  Scene scene;
  scene.name = std::move(name);
  scene.model = BuildModel(description);
  scene.state = RestState(*scene.model);
  return scene;
}

}  // namespace

std::shared_ptr<const SceneModel> BuildModel(const ModelDescription& description) {
  auto model = SceneModel::Build(description);
  DRAPE_CHECK(model.ok(), model.status().ToString());
  return *model;
}

StepPlan PlanOf(const Scene& scene) {
  return PlanStep(*scene.model, scene.parameters, LengthSource::kModel, ScalarType::kFloat32);
}

ParticleState RestState(const SceneModel& model) {
  return {{model.rest_positions_m().begin(), model.rest_positions_m().end()},
          std::vector<Vector3d>(model.particle_count(), Vector3d::Zero())};
}

Scene Grid(uint32_t columns, uint32_t rows, double width_m, double height_m,
           std::vector<uint32_t> pins, const StructuralMaterial& material) {
  return MakeScene("grid_" + std::to_string(columns) + "x" + std::to_string(rows),
                   {GridTopology{columns, rows, width_m, height_m}, material, std::move(pins)});
}

Scene MeshedGrid(uint32_t columns, uint32_t rows, double width_m, double height_m,
                 std::vector<uint32_t> pins, const StructuralMaterial& material) {
  TriangleMesh mesh;
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t column = 0; column < columns; ++column) {
      mesh.positions_m.emplace_back(width_m * column / (columns - 1), 0,
                                    height_m * row / (rows - 1));
      if (row + 1 == rows || column + 1 == columns) continue;
      const uint32_t a = row * columns + column, b = a + 1, c = a + columns, d = c + 1;
      if ((row + column) % 2 == 0) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, d}, {a, d, b}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {b, c, d}});
      }
    }
  }
  return MakeScene("mesh_" + std::to_string(columns) + "x" + std::to_string(rows),
                   {mesh, material, std::move(pins)});
}

Scene Particles(const ParticleTopology& particles, std::vector<uint32_t> pins) {
  return MakeScene("particles_" + std::to_string(particles.positions_m.size()),
                   {particles, {}, std::move(pins)});
}

Scene SizedCloth(uint32_t particle_count, bool has_pins) {
  if (particle_count == 1) {
    return Particles({{Vector3d(0.1, 0.2, 0.3)}, {0.01}, {}, {}});
  }
  uint32_t rows = static_cast<uint32_t>(std::sqrt(particle_count));
  while (particle_count % rows != 0) --rows;
  const uint32_t columns = particle_count / rows;
  constexpr double kEdge_m = 0.05;
  std::vector<uint32_t> pins;
  if (has_pins) pins = particle_count > 3 ? std::vector{0u, columns - 1} : std::vector{0u};
  return Grid(columns, rows, kEdge_m * (columns - 1), kEdge_m * std::max(rows - 1, 1u), pins);
}

Scene Chain(uint32_t links, double link_m, double mass_kg) {
  ParticleTopology particles;
  for (uint32_t i = 0; i <= links; ++i) {
    particles.positions_m.emplace_back(link_m * i, 0, 0);
    particles.masses_kg.push_back(mass_kg);
    if (i > 0) particles.distance_constraints.push_back({i - 1, i, link_m, 0});
  }
  Scene scene = Particles(particles, {0});
  scene.name = "chain_" + std::to_string(links);
  return scene;
}

Scene Net(uint32_t side, double cord_m, double compliance_m_per_n) {
  ParticleTopology particles;
  for (uint32_t row = 0; row < side; ++row) {
    for (uint32_t column = 0; column < side; ++column) {
      const uint32_t i = row * side + column;
      particles.positions_m.emplace_back(cord_m * column, 0, cord_m * row);
      particles.masses_kg.push_back(0.002 + 0.001 * (i % 3));  // no two neighbours equal
      const auto tie = [&](uint32_t other) {
        particles.distance_constraints.push_back({other, i, cord_m, compliance_m_per_n});
      };
      if (column > 0) tie(i - 1);
      if (row > 0) tie(i - side);
      if (row > 0 && column > 0 && i % 2 == 0) {
        particles.springs.push_back({i - side - 1, i, cord_m * std::sqrt(2.0), 5, 0.001});
      }
    }
  }
  Scene scene = Particles(particles, {0, side - 1, side * (side - 1), side * side - 1});
  scene.name = "net_" + std::to_string(side);
  return scene;
}

Scene FallingOnSphere(uint32_t side) {
  Scene scene = Grid(side, side, 1, 1);
  scene.name = "sphere_" + std::to_string(side);
  scene.parameters.colliders = {SphereAt(Vector3d(0.5, -0.35, 0.5), 0.3),
                                PlaneThrough(Vector3d(0, -0.65, 0), Vector3d::UnitY())};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.thickness_m = 0.002;
  return scene;
}

Scene FallingOnBoxAndCapsule(uint32_t side) {
  Scene scene = FallingOnSphere(side);
  scene.name = "box_and_capsule_" + std::to_string(side);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Vector3d::UnitY()));
  scene.parameters.colliders = {
      BoxAt(Vector3d(0.24, -0.2, 0.52), Vector3d(0.17, 0.15, 0.31), turn),
      CapsuleBetween(Vector3d(0.7, -0.16, 0.13), Vector3d(0.81, -0.16, 0.84), 0.11)};
  return scene;
}

Scene MeshHalfOnBox(uint32_t side) {
  Scene scene = MeshedGrid(side, side, 1, 1, {}, {.stretch_stiffness_n_per_m = 2000});
  scene.name = "mesh_half_on_box_" + std::to_string(side);
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.colliders = {BoxAt(Vector3d(0.2, -0.25, 0.5), Vector3d(0.35, 0.25, 0.7))};
  return scene;
}

Scene FallingOnDistanceMap(uint32_t side) {
  Scene scene = FallingOnSphere(side);
  scene.name = "distance_map_" + std::to_string(side);
  const auto map =
      DistanceMap::Build(BoxMesh({-0.8, -0.3, -0.8}, {0.8, 0, 0.8}), {.resolution = 24});
  DRAPE_CHECK(map.ok(), map.status().ToString());
  const Eigen::Quaterniond turn =
      Eigen::AngleAxisd(0.3, Vector3d::UnitY()) * Eigen::AngleAxisd(0.1, Vector3d(0.6, 0, 0.8));
  scene.parameters.colliders = {DistanceMapAt(*map, {Vector3d(0.5, -0.06, 0.5), turn})};
  return scene;
}

Scene CompliantSheet(uint32_t side, double compliance_m_per_n) {
  StructuralMaterial material;
  material.stretch_compliance_m_per_n = compliance_m_per_n;
  material.bending_stiffness_n_per_m = 0.5;
  material.shear_stiffness_n_per_m = 2;
  Scene scene = Grid(side, side, 1, 1, {0, side - 1}, material);
  scene.name = "compliant_" + std::to_string(side);
  return scene;
}

Scene ExplosiveSheet(uint32_t side) {
  const Scene sheet = Grid(side, side, 1, 1);
  ParticleTopology particles;
  particles.positions_m = sheet.state.positions_m;
  particles.masses_kg.assign(sheet.model->masses_kg().begin(), sheet.model->masses_kg().end());
  const auto constraints = sheet.model->constraints();
  particles.distance_constraints.assign(constraints.begin(), constraints.end());
  particles.springs = {{0, side * side - 1, 0.1, 1e15, 0}};
  Scene scene = Particles(particles);
  scene.name = "explosive_" + std::to_string(side);
  return scene;
}

void Stir(Scene& scene, double speed_m_per_s) {
  const auto rest = scene.model->rest_positions_m();
  for (uint32_t i = 0; i < scene.model->particle_count(); ++i) {
    if (scene.model->inverse_masses_per_kg()[i] == 0) continue;
    const Vector3d& p = rest[i];
    const Vector3d field(std::sin(3 * p.z() + 1), std::cos(4 * p.x() - 2 * p.z()),
                         std::sin(5 * p.x() + 0.5));
    scene.state.velocities_m_per_s[i] += speed_m_per_s / std::sqrt(3.0) * field;
  }
}

void GripParticles(Scene& scene, const std::vector<uint32_t>& particles, const Vector3d& way_m) {
  scene.parameters.max_grips = kMaxGrips;
  for (const uint32_t i : particles) {
    scene.grips.push_back({i, scene.state.positions_m[i] + way_m});
  }
}

ClothHandle CreateCloth(Backend& backend, const Scene& scene) {
  auto cloth = backend.Create(scene.model, scene.parameters, scene.state);
  DRAPE_CHECK(cloth.ok(), cloth.status().ToString());
  if (!scene.rest_length_targets_m.empty()) {
    ClothUpdate update;
    update.rest_lengths_m.emplace();
    for (const DistanceConstraint& constraint : scene.model->constraints()) {
      update.rest_lengths_m->push_back(constraint.rest_length_m);
    }
    const Status written = backend.Write(*cloth, update);
    DRAPE_CHECK(written.ok(), written.ToString());
  }
  return *cloth;
}

StepReport StepAlone(Backend& backend, ClothHandle cloth, const Scene& scene, uint32_t steps,
                     bool measure) {
  StepReport report;
  for (uint32_t step = 0; step < steps; ++step) {
    const StepItem item{.cloth = cloth,
                        .pin_targets_m = scene.pin_targets_m,
                        .measure = measure && step + 1 == steps,
                        .rest_lengths_m = scene.rest_length_targets_m,
                        .grips = scene.grips};
    report = backend.Step({&item, 1}).reports.at(0);
  }
  return report;
}

}  // namespace drape::test
