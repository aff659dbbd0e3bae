#include "tests/golden/golden_scenes.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "server/core/check.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/reach_scenes.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

struct NamedPreset {
  const char* name;
  StepSettings settings;
};

// Few substeps: the test records results, whatever their quality.
std::vector<NamedPreset> Presets() {
  std::vector<NamedPreset> presets = {{"paper", PresetSettings(Preset::kPaper)},
                                      {"realtime", PresetSettings(Preset::kRealtime)},
                                      {"accurate", PresetSettings(Preset::kAccurate)}};
  presets[1].settings.substeps = 12;
  presets[2].settings.substeps = 6;
  presets[2].settings.tolerance = 1e-4;
  return presets;
}

Scene Named(std::string name, Scene scene) {
  scene.name = std::move(name);
  return scene;
}

Scene Sheet() {
  return Named("sheet", Grid(13, 10, 0.6, 0.5, {0, 12}));
}

Scene Fabric(const std::string& name, double stretch_n_per_m) {
  return Named(name, Grid(12, 9, 0.5, 0.5, {0},
                          {.stretch_stiffness_n_per_m = stretch_n_per_m,
                           .bending_rigidity_n_m = 1e-4,
                           .shear_modulus_n_per_m = 20}));
}

// Meets the collider below it within the first or the second step.
Scene Thrown(Scene scene) {
  for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -3;
  return scene;
}

Scene Windy(Scene scene) {
  scene.name += "_windy";
  scene.parameters.wind_m_per_s = {1, 3, 2};
  scene.parameters.air_drag = 1.2;
  scene.parameters.air_lift = 0.8;
  return scene;
}

Scene Pushed(Scene scene) {
  scene.name += "_pushed";
  for (const Collider& collider : scene.parameters.colliders) {
    scene.parameters.collider_motions.push_back(RigidMotion::AtRest(CentreOf(collider)));
  }
  scene.parameters.collider_motions[0].velocity_m_per_s = {0.2, 3, 0.1};
  scene.parameters.collider_motions[0].angular_velocity_rad_per_s = {0, 2, 1};
  scene.parameters.restitution = 0.3;
  return scene;
}

Scene WithDrivenLengths(Scene scene, double amplitude) {
  scene.name += "_driven_lengths";
  scene.rest_length_targets_m = UnevenLengths(*scene.model, amplitude);
  return scene;
}

Scene WithDrivenPins(Scene scene) {
  scene.name += "_driven_pins";
  for (const uint32_t pin : scene.model->pins()) {
    scene.pin_targets_m.push_back(scene.state.positions_m[pin] + Vector3d(0.01, 0.02, -0.01));
  }
  return scene;
}

// A closed fan: a mesh with a particle of seven neighbours, and no grid.
Scene Fan() {
  ParticleTopology particles;
  constexpr uint32_t kRim = 7;
  constexpr double turn = 2 * std::numbers::pi / kRim;
  particles.positions_m.push_back({0, 0, 0});
  for (uint32_t k = 0; k < kRim; ++k) {
    particles.positions_m.push_back({0.3 * std::cos(turn * k), 0, 0.3 * std::sin(turn * k)});
  }
  for (uint32_t k = 1; k <= kRim; ++k) {
    const uint32_t next = k % kRim + 1;
    for (const auto& [i, j] : {std::pair{0u, k}, {k, next}}) {
      const double length_m = (particles.positions_m[i] - particles.positions_m[j]).norm();
      particles.distance_constraints.push_back({i, j, length_m, 0});
    }
  }
  particles.masses_kg.assign(kRim + 1, 0.01);
  return Named("fan", Particles(particles, {1}));
}

// All but the large ones; each with every preset.
std::vector<Scene> Shapes() {
  std::vector<Scene> shapes = {
      SizedCloth(1),
      SizedCloth(2),
      SizedCloth(31, false),
      SizedCloth(33),
      Sheet(),
      Named("free_sheet", Grid(9, 9, 0.4, 0.4)),
      WithDrivenPins(Sheet()),
      WithDrivenLengths(Sheet(), 0.02),
      Windy(Sheet()),
      Chain(20, 0.05, 0.01),
      WithDrivenLengths(Chain(20, 0.05, 0.01), 0.05),
      Net(9, 0.1, 1e-5),
      Named("rigid_net", Net(7, 0.1, 0)),
      Fan(),
      JointedChain(6, 0.1, 0),
      Named("compliant_joints", JointedChain(6, 0.1, 1e-4)),
      RopesAndStruts(6, 0.1, 0),
      Named("compliant_ropes", RopesAndStruts(6, 0.1, 1e-5)),
      WithDrivenLengths(RopesAndStruts(6, 0.1, 0), 0.02),
      CompliantSheet(9, 1e-5),
      Named("springs", CompliantSheet(9, 0)),
      Named("stretchy", Grid(9, 7, 0.5, 0.4, {0, 8}, {.stretch_stiffness_n_per_m = 2000})),
      Named("stiff_mesh", MeshedGrid(9, 8, 0.5, 0.4, {0}, {.bending_rigidity_n_m = 5})),
      Fabric("fabric", 0),
      Fabric("stretchy_fabric", 300),
      Windy(Fabric("fabric", 0)),
      Thrown(FallingOnSphere(13)),
      Thrown(FallingOnBoxAndCapsule(13)),
      Thrown(FallingOnDistanceMap(13)),
      Thrown(Pushed(FallingOnSphere(11))),
      Thrown(Pushed(FallingOnBoxAndCapsule(11))),
      Thrown(Pushed(FallingOnDistanceMap(11))),
      ExplosiveSheet(6),
  };
  for (Scene& shape : shapes) Stir(shape, 0.3);
  return shapes;
}

// A sheet, with its one switch set, hung and thrown at a sphere.
std::vector<Scene> Switches() {
  const StepSettings realtime = Presets()[1].settings;
  const std::vector<std::pair<std::string, std::function<void(StepSettings&)>>> switches = {
      {"one_step", [](StepSettings& s) { s.integration = Integration::kOneStep; }},
      {"at_end",
       [](StepSettings& s) {
         s.integration = Integration::kOneStep;
         s.direction = Direction::kAtEnd;
       }},
      {"at_start",
       [](StepSettings& s) {
         s.integration = Integration::kOneStep;
         s.direction = Direction::kAtStart;
       }},
      {"velocity_iterations",
       [](StepSettings& s) {
         s.integration = Integration::kOneStep;
         s.direction = Direction::kAtStart;
         s.velocity_iterations = 2;
       }},
      {"colours", [](StepSettings& s) { s.sweep = Sweep::kColours; }},
      {"colours_velocity_iterations",
       [](StepSettings& s) {
         s.sweep = Sweep::kColours;
         s.velocity_iterations = 3;
       }},
      {"in_force", [](StepSettings& s) { s.spring_integration = SpringIntegration::kInForce; }},
      {"no_tethers", [](StepSettings& s) { s.use_tethers = false; }},
      {"no_twist_damping", [](StepSettings& s) { s.twist_damping_per_s = 0; }},
      {"no_refinement", [](StepSettings& s) { s.refine_above_strain = 0; }},
      {"much_refinement", [](StepSettings& s) { s.refine_above_strain = 1e-5; }},
      {"several_sweeps", [](StepSettings& s) { s.max_iterations = 3; }},
      {"tolerance",
       [](StepSettings& s) {
         s.max_iterations = 5;
         s.tolerance = 1e-3;
       }},
      {"tolerance_colours",
       [](StepSettings& s) {
         s.sweep = Sweep::kColours;
         s.max_iterations = 9;
         s.tolerance = 1e-2;
       }},
      {"tolerance_too_tight",
       [](StepSettings& s) {
         s.max_iterations = 3;
         s.tolerance = 1e-12;
       }},
      {"one_substep", [](StepSettings& s) { s.substeps = 1; }},
      {"short_steps", [](StepSettings& s) { s.time_step_s = 1.0 / 240; }},
  };
  std::vector<Scene> scenes;
  for (const auto& [name, set] : switches) {
    for (Scene scene : {Sheet(), Thrown(FallingOnSphere(11)),
                        Named("springs", CompliantSheet(7, 0)), Fabric("fabric", 0)}) {
      Stir(scene, 0.3);
      scene.name += "_" + name;
      scene.parameters.settings = realtime;
      set(scene.parameters.settings);
      scenes.push_back(std::move(scene));
    }
  }
  return scenes;
}

// One parameter of the cloth at a time.
std::vector<Scene> ParameterScenes() {
  std::vector<Scene> scenes;
  const auto add = [&](const std::string& name, Scene scene, auto change) {
    Stir(scene, 0.3);
    scene.parameters.settings = Presets()[1].settings;
    scene.name += "_" + name;
    change(scene.parameters);
    scenes.push_back(std::move(scene));
  };
  const Scene falling = Thrown(FallingOnSphere(11));
  add("damped", Sheet(), [](ClothParameters& p) { p.damping_per_s = 0.7; });
  add("weightless", Sheet(), [](ClothParameters& p) { p.gravity_m_per_s2.setZero(); });
  add("heavy", Sheet(), [](ClothParameters& p) { p.gravity_m_per_s2 *= 50; });
  add("drag_only", Sheet(), [](ClothParameters& p) { p.air_drag = 1; });
  add("damped", falling, [](ClothParameters& p) { p.damping_per_s = 0.7; });
  add("frictionless", falling,
      [](ClothParameters& p) { p.friction_static = p.friction_dynamic = 0; });
  add("thick", falling, [](ClothParameters& p) { p.thickness_m = 0.01; });
  add("bouncing", falling, [](ClothParameters& p) { p.restitution = 0.8; });
  add("windy", falling, [](ClothParameters& p) {
    p.wind_m_per_s = {2, 1, 4};
    p.air_drag = 1;
  });
  return scenes;
}

// Beyond one work group of a GPU, and beyond what one thread steps.
std::vector<Scene> LargeScenes() {
  std::vector<Scene> scenes = {SizedCloth(1500), SizedCloth(5000, false),
                               Thrown(FallingOnSphere(40)), Thrown(Pushed(FallingOnSphere(36))),
                               Thrown(FallingOnDistanceMap(40))};
  scenes.push_back(Windy(Named("large_fabric", Grid(40, 30, 1, 1, {0, 39},
                                                    {.stretch_stiffness_n_per_m = 300,
                                                     .bending_rigidity_n_m = 1e-4,
                                                     .shear_modulus_n_per_m = 20}))));
  scenes.push_back(WithDrivenLengths(Named("large_sheet", Grid(40, 30, 1, 1, {0, 39})), 0.01));
  for (Scene& scene : scenes) {
    Stir(scene, 0.3);
    scene.parameters.settings = Presets()[1].settings;
    scene.parameters.settings.substeps = 4;
    scene.parameters.settings.refine_above_strain = 1e-5;
  }
  return scenes;
}

}  // namespace

std::vector<Scene> GoldenScenes() {
  std::vector<Scene> scenes;
  for (const NamedPreset& preset : Presets()) {
    for (Scene shape : Shapes()) {
      shape.name += std::string("_") + preset.name;
      shape.parameters.settings = preset.settings;
      scenes.push_back(std::move(shape));
    }
  }
  for (auto& group : {Switches(), ParameterScenes(), LargeScenes()}) {
    scenes.insert(scenes.end(), group.begin(), group.end());
  }
  for (ReachCase& reach : ReachCases(9, 7)) {
    reach.scene.name = "reach_" + reach.scene.name;
    scenes.push_back(std::move(reach.scene));
  }
  return scenes;
}

std::vector<Scene> FewGoldenScenes() {
  const std::set<std::string> few = {"sheet_realtime",
                                     "sheet_paper",
                                     "sphere_13_realtime",
                                     "sphere_11_pushed_paper",
                                     "distance_map_13_paper",
                                     "fabric_windy_realtime",
                                     "compliant_9_accurate",
                                     "compliant_joints_paper",
                                     "ropes_and_struts_6_driven_lengths_realtime",
                                     "sheet_velocity_iterations",
                                     "grid_50x30"};
  std::vector<Scene> scenes;
  for (Scene& scene : GoldenScenes()) {
    if (few.contains(scene.name)) scenes.push_back(std::move(scene));
  }
  DRAPE_CHECK(scenes.size() == few.size(), "a scene is missing");
  return scenes;
}

Scene GoldenCopy(Scene scene, uint32_t index) {
  scene.parameters.gravity_m_per_s2 += Vector3d(0.07, 0.05, -0.03) * index;
  if (index % 2 == 1) scene.parameters.damping_per_s += 0.1;
  return scene;
}

}  // namespace drape::test
