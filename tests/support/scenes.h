// Small cloths for tests and benchmarks, by purpose.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/backend.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/step_plan.h"
#include "tests/support/plain_settings.h"

namespace drape::test {

// Everything that makes a cloth and drives it.
struct Scene {
  std::string name;  // letters, digits and _, for names of test cases
  std::shared_ptr<const SceneModel> model;
  ClothParameters parameters = PlainParameters();
  ParticleState state;
  std::vector<Eigen::Vector3d> pin_targets_m;  // of every step; empty: the pins stay
  // At the end of every step, in the order of the model; empty: the model's.
  std::vector<double> rest_length_targets_m{};
  std::vector<Grip> grips{};  // of every step
};

// Grips these particles, ascending, which move by `way_m`.
void GripParticles(Scene& scene, const std::vector<uint32_t>& particles,
                   const Eigen::Vector3d& way_m = Eigen::Vector3d::Zero());

// Ends the process with the reason if the description is refused.
std::shared_ptr<const SceneModel> BuildModel(const ModelDescription& description);

// Its step in single precision, with the lengths of its model.
StepPlan PlanOf(const Scene& scene);

// The rest shape, not moving.
ParticleState RestState(const SceneModel& model);

// A sheet of width x height, 0.2 kg/m^2, in the xz plane, PlainSettings, at rest. All scenes
// below start from this one or from Particles.
Scene Grid(uint32_t columns, uint32_t rows, double width_m, double height_m,
           std::vector<uint32_t> pins = {}, const StructuralMaterial& material = {});
// The same particles as a mesh, two triangles per cell whose diagonals alternate.
Scene MeshedGrid(uint32_t columns, uint32_t rows, double width_m, double height_m,
                 std::vector<uint32_t> pins = {}, const StructuralMaterial& material = {});
Scene Particles(const ParticleTopology& particles, std::vector<uint32_t> pins = {});

// Exactly this many particles: one lone particle, or the grid whose sides are closest to each other
// (31 x 1, 11 x 3, 41 x 25, ...), edges 5 cm; two corners of the first row pinned if has_pins.
Scene SizedCloth(uint32_t particle_count, bool has_pins = true);
// One particle, then sizes around those of work groups and lanes.
inline const std::vector<uint32_t> kAwkwardSizes = {1, 2, 3, 31, 33, 1024, 1025, 5000};

// Links of link_m each along +x, the first particle pinned, mass_kg each.
Scene Chain(uint32_t links, double link_m, double mass_kg);

// Square meshes of knots and compliant cords, made of particles and constraints one by one, all
// four corners pinned, a few springs across.
Scene Net(uint32_t side, double cord_m, double compliance_m_per_n);

// A sheet of 1 m falling from 5 cm above a sphere of 0.3 m, over a plane, with friction.
Scene FallingOnSphere(uint32_t side);

// The same sheet over a turned box and, as high, an oblique capsule.
Scene FallingOnBoxAndCapsule(uint32_t side);

// The same sheet over the slightly inclined, larger top of a box that is a distance map. On a face
// of the box far from its edges the distance is linear, so that its gradient does not depend on the
// cell.
Scene FallingOnDistanceMap(uint32_t side);

// A mesh that lies on the top of a box, as large as half of it, with friction, and begins to fall
// where there is none.
Scene MeshHalfOnBox(uint32_t side);

// Two corners pinned, stretch compliance, bending and shear springs.
Scene CompliantSheet(uint32_t side, double compliance_m_per_n);

// A grid whose one spring is so stiff that explicit integration fails within a step or two: FAULTED
// on every backend, on the way there infinities and NaN.
Scene ExplosiveSheet(uint32_t side);

// Adds a smooth, lopsided velocity field of at most speed_m_per_s to the free particles, so that
// nothing stays symmetric or planar.
void Stir(Scene& scene, double speed_m_per_s);

ClothHandle CreateCloth(Backend& backend, const Scene& scene);

// Steps one cloth alone and returns the last report, measured on request.
StepReport StepAlone(Backend& backend, ClothHandle cloth, const Scene& scene, uint32_t steps = 1,
                     bool measure = false);

}  // namespace drape::test
