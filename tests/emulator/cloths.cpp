#include "tests/emulator/cloths.h"

#include <set>
#include <utility>

#include "tests/emulator/compiled_kernel.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/reach_scenes.h"

namespace drape::emulator {

namespace {

using Eigen::Vector3d;
using test::Scene;

struct Size {
  uint32_t columns;
  uint32_t rows;
};

constexpr uint32_t kSubsteps = 3;

// Thrown about, damped, with everything that REALTIME does.
Scene Named(const std::string& name, Scene scene) {
  scene.name = name;
  StepSettings& settings = scene.parameters.settings;
  settings = PresetSettings(Preset::kRealtime);
  settings.substeps = kSubsteps;
  settings.load_limit = 0;
  settings.sleep_motion_m = 0;
  settings.twist_damping_per_s = 20;
  settings.refine_above_strain = 0.01;
  scene.parameters.damping_per_s = 0.2;
  test::Stir(scene, 2);
  return scene;
}

Scene Sheet(const std::string& name, Size size, const StructuralMaterial& material = {}) {
  return Named(name, test::Grid(size.columns, size.rows, 1.5, 1, {0, size.columns - 1}, material));
}

// Onto colliders that it touches at once, with friction.
Scene Fallen(const std::string& name, Scene scene) {
  scene = Named(name, std::move(scene));
  for (Vector3d& v : scene.state.velocities_m_per_s) v.y() -= 4;
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  return scene;
}

Scene AmongMovingShapes(Size size) {
  Scene scene = Fallen("moving_shapes", test::Grid(size.columns, size.rows, 1, 1));
  scene.parameters.restitution = 0.3;
  scene.parameters.thickness_m = 0.002;
  for (const auto& [kind, collider] : test::EveryKind(-0.01)) {
    scene.parameters.colliders.push_back(collider);
    RigidMotion motion = RigidMotion::AtRest(CentreOf(collider));
    motion.velocity_m_per_s = {0.2, 1, 0};
    motion.angular_velocity_rad_per_s = {0, 0.5, 0.1};
    scene.parameters.collider_motions.push_back(motion);
  }
  return scene;
}

Scene Gripped(Size size) {
  Scene scene = Fallen("gripped", test::Grid(size.columns, size.rows, 1, 1));
  scene.parameters.colliders = {test::Wall(1.1)};
  scene.parameters.max_grips = 4;
  test::GripParticles(scene, {2, size.columns + 3, size.columns * size.rows - 2}, {0, 0.01, 0});
  return scene;
}

Scene Windy(const std::string& name, Scene scene) {
  scene = Named(name, std::move(scene));
  scene.parameters.wind_m_per_s = {3, 1, 2};
  scene.parameters.air_drag = scene.parameters.air_lift = 1;
  return scene;
}

Scene InColours(Scene scene) {
  StepSettings& settings = scene.parameters.settings;
  settings.sweep = Sweep::kColours;
  settings.max_iterations = 4;
  settings.tolerance = 1e-4;
  return scene;
}

// One step, with velocities that constraints forbid removed.
Scene ByOneStep(Scene scene) {
  StepSettings& settings = scene.parameters.settings;
  settings.integration = Integration::kOneStep;
  settings.direction = Direction::kAtStart;
  settings.velocity_iterations = 2;
  settings.max_iterations = 3;
  return scene;
}

Scene OwnLengths(Scene scene) {
  scene.rest_length_targets_m = test::UnevenLengths(*scene.model, 0.02);
  return scene;
}

EmulatedCloth Telling(EmulatedCloth cloth) {
  cloth.scene.name += "_impulses";
  cloth.tells_impulses = true;
  return cloth;
}

// Those of these names, asked for impulses, too.
void AddTelling(const std::set<std::string>& names, std::vector<EmulatedCloth>& cloths) {
  const size_t count = cloths.size();
  for (size_t k = 0; k < count; ++k) {
    if (names.contains(cloths[k].scene.name)) cloths.push_back(Telling(cloths[k]));
  }
}

}  // namespace

std::vector<EmulatedCloth> ResidentCloths() {
  constexpr Size kSize{9, 7};
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20};
  const StructuralMaterial hinged{.bending_rigidity_n_m = 1e-4};
  std::vector<EmulatedCloth> cloths;
  const auto add = [&cloths](Scene scene, const GlTuning& tuning = {}) {
    cloths.push_back({.scene = std::move(scene), .tuning = tuning});
  };
  add(Sheet("elimination", kSize));
  add(Sheet("from_both_ends", kSize),
      {.strip_solve = StripSolve::kFromBothEnds, .correct_roots = false, .share_record = true});
  add(Sheet("reduction", kSize), {.strip_solve = StripSolve::kReductionWithBarriers});
  // The first particle is free, and groups of lanes are not full.
  cloths.push_back({.scene = Named("reduction_by_shuffles", test::Grid(9, 7, 1.5, 1, {8, 62})),
                    .tuning = {.strip_solve = StripSolve::kReductionWithBarriers},
                    .define = "HAS_SUBGROUPS"});
  // Lanes have four particles; in some strips the first, second, third or last link of a lane ends
  // at a pin.
  cloths.push_back(
      {.scene = Named("quads_by_shuffles", test::Grid(27, 19, 1.5, 1, {26, 59, 61, 91, 116})),
       .tuning = {.strip_solve = StripSolve::kReductionWithBarriers},
       .define = "HAS_SUBGROUPS"});
  cloths.push_back({.scene = Fallen("sphere_by_shuffles", test::FallingOnSphere(8)),
                    .tuning = {.strip_solve = StripSolve::kReductionWithBarriers},
                    .define = "HAS_SUBGROUPS"});
  add(Sheet("in_parts", kSize), {.loop_budget = 1500});
  add(AmongMovingShapes(kSize));
  add(Fallen("sphere", test::FallingOnSphere(8)), {.strip_solve = StripSolve::kFromBothEnds});
  add(Gripped(kSize), {.strip_solve = StripSolve::kFromBothEnds});
  add(Windy("bending_shear_wind", test::Grid(kSize.columns, kSize.rows, 1.5, 1, {0}, fabric)));
  add(Windy("mesh", test::MeshedGrid(kSize.columns, kSize.rows, 1, 1, {0, 8}, hinged)));
  add(ByOneStep(Named("springs", test::CompliantSheet(7, 1e-4))));
  add(InColours(Named("net", test::Net(6, 0.1, 1e-5))));
  add(ByOneStep(Named("joints", test::JointedChain(12, 0.1, 1e-4))));
  add(OwnLengths(InColours(Named("own_lengths", test::RopesAndStruts(6, 0.1, 0)))));
  AddTelling({"reduction_by_shuffles", "quads_by_shuffles", "in_parts", "moving_shapes", "gripped",
              "bending_shear_wind", "mesh", "springs", "joints", "own_lengths"},
             cloths);
  // By lines and by hinges, which pins meet in several of them.
  const std::vector<uint32_t> pins = {0, 1, kSize.columns, 2 * kSize.columns};
  cloths.push_back(Telling(
      {.scene = Named("lines",
                      test::Grid(kSize.columns, kSize.rows, 0.5, 0.4, pins,
                                 {.bending_rigidity_n_m = 20, .shear_modulus_n_per_m = 2e5}))}));
  cloths.push_back(
      Telling({.scene = Named("hinges", test::MeshedGrid(kSize.columns, kSize.rows, 1, 1, pins,
                                                         {.bending_rigidity_n_m = 1}))}));
  return cloths;
}

// Thrown together, so that it crumples: pairs, pushes of the guard, zones, and a search in the
// guard.
Scene Crumpled(const std::string& name, Scene scene, double speed_m_per_s) {
  scene = Named(name, std::move(scene));
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  scene.parameters.self_collision.emplace().thickness_m = 0.01;
  for (size_t i = 0; i < scene.state.positions_m.size(); ++i) {
    // Two layers, half as wide, that fly at each other.
    Vector3d& p = scene.state.positions_m[i];
    const bool is_upper = p.x() > 0.25;
    if (is_upper) p.x() = 0.5 - p.x();
    p.y() += is_upper ? 0.02 : 0.0;
    scene.state.velocities_m_per_s[i].y() += is_upper ? -speed_m_per_s : speed_m_per_s;
  }
  return scene;
}

std::vector<EmulatedCloth> TouchingCloths() {
  std::vector<EmulatedCloth> cloths;
  cloths.push_back({.scene = Crumpled("touches_itself", test::Grid(8, 5, 0.5, 0.3), 1)});
  cloths.push_back(
      {.scene = Crumpled("touches_itself_beside_pins", test::Grid(7, 5, 0.5, 0.3, {0, 6}), 20)});
  Scene scene = InColours(
      ByOneStep(Crumpled("touches_itself_by_one_step", test::MeshedGrid(7, 5, 0.5, 0.3, {2}), 5)));
  cloths.push_back({.scene = std::move(scene)});
  for (EmulatedCloth& cloth : cloths) cloth.scene.parameters.settings.substeps = 2;
  AddTelling({"touches_itself_beside_pins", "touches_itself_by_one_step"}, cloths);
  return cloths;
}

std::vector<EmulatedCloth> TiledCloths() {
  constexpr Size kSize{33, 32};
  const StructuralMaterial fabric{.bending_rigidity_n_m = 1e-4, .shear_modulus_n_per_m = 20};
  const StructuralMaterial hinged{.bending_rigidity_n_m = 1e-4};
  std::vector<EmulatedCloth> cloths;
  for (Scene& scene : std::vector<Scene>{
           Sheet("tiled_sheet", kSize), AmongMovingShapes(kSize),
           Windy("tiled_bending_shear_wind",
                 test::Grid(kSize.columns, kSize.rows, 1.5, 1, {0}, fabric)),
           Windy("tiled_mesh", test::MeshedGrid(kSize.columns, kSize.rows, 1, 1, {0, 8}, hinged)),
           ByOneStep(Named("tiled_springs", test::CompliantSheet(33, 1e-4))),
           OwnLengths(InColours(Named("tiled_own_lengths", test::RopesAndStruts(33, 0.1, 0)))),
           ByOneStep(Named("tiled_joints", test::JointedChain(520, 0.1, 1e-4)))}) {
    scene.parameters.settings.substeps = 2;
    cloths.push_back({.scene = std::move(scene)});
  }
  AddTelling({"tiled_sheet", "moving_shapes", "tiled_bending_shear_wind", "tiled_joints"}, cloths);
  return cloths;
}

std::vector<CapturedDispatch> DispatchesOf(const EmulatedCloth& cloth) {
  Capture capture;
  const std::unique_ptr<Backend> backend = MakeGlBackend(cloth.tuning);
  const ClothHandle handle = test::CreateCloth(*backend, cloth.scene);
  capture.Keep(true);
  for (uint32_t step = 1; step <= cloth.steps; ++step) {
    const StepItem item{.cloth = handle,
                        .pin_targets_m = cloth.scene.pin_targets_m,
                        .measure = step == cloth.steps,
                        .rest_lengths_m = cloth.scene.rest_length_targets_m,
                        .grips = cloth.scene.grips,
                        .impulses = cloth.tells_impulses};
    backend->Step({&item, 1});
  }
  ReadCloth(*backend, handle);
  capture.Keep(false);
  std::vector<CapturedDispatch> dispatches = capture.Take();
  if (cloth.define.empty()) return dispatches;
  for (CapturedDispatch& dispatch : dispatches) {
    if (dispatch.kernel != "resident_step") continue;
    dispatch.glsl = WithDefine(dispatch.glsl, cloth.define);
    dispatch.lines.insert(dispatch.lines.begin(), {"defines", 1});
  }
  return dispatches;
}

}  // namespace drape::emulator
