// Nothing depends on where a cloth is, how it is turned or how fast all of it moves (Galilean
// invariance).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

// x -> rotation x + shift + velocity t.
struct Frame {
  std::string name;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Vector3d shift_m = Vector3d::Zero();
  Vector3d velocity_m_per_s = Vector3d::Zero();

  Vector3d PositionAt(double t, const Vector3d& p) const {
    return rotation * p + shift_m + velocity_m_per_s * t;
  }
};

std::vector<Frame> Frames() {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(2.2, Vector3d(0.36, 0.48, 0.8)));
  return {{.name = "turned", .rotation = turn},
          {.name = "shifted", .shift_m = Vector3d(3, -2, 5)},
          {.name = "moving", .velocity_m_per_s = Vector3d(2, 1, -3)},
          {"all", turn, Vector3d(3, -2, 5), Vector3d(2, 1, -3)}};
}

class FrameIndependence : public PresetTest {
 protected:
  static constexpr uint32_t kSteps = 8;

  // The scene's positions after kSteps in a frame, brought back into the scene's own. The pins, if
  // any, move with the frame, and so do colliders.
  std::vector<Vector3d> SeenFrom(const Frame& frame, Scene scene) {
    const double step_s = scene.parameters.settings.time_step_s;
    const std::vector<Vector3d> rest = scene.state.positions_m;
    for (Vector3d& p : scene.state.positions_m) p = frame.PositionAt(0, p);
    for (Vector3d& v : scene.state.velocities_m_per_s) {
      v = frame.rotation * v + frame.velocity_m_per_s;
    }
    ClothParameters& parameters = scene.parameters;
    parameters.gravity_m_per_s2 = frame.rotation * parameters.gravity_m_per_s2;
    parameters.wind_m_per_s = frame.rotation * parameters.wind_m_per_s + frame.velocity_m_per_s;
    for (Collider& collider : parameters.colliders) {
      collider.pose.position_m = frame.PositionAt(0, collider.pose.position_m);
      if (frame.velocity_m_per_s.isZero(0)) continue;
      parameters.collider_motions.push_back(RigidMotion::AtRest(collider.pose.position_m));
      parameters.collider_motions.back().velocity_m_per_s = frame.velocity_m_per_s;
    }
    const ClothHandle cloth = Make(scene);
    for (uint32_t step = 1; step <= kSteps; ++step) {
      scene.pin_targets_m.clear();
      for (const uint32_t pin : scene.model->pins()) {
        scene.pin_targets_m.push_back(frame.PositionAt(step * step_s, rest[pin]));
      }
      contacts_ += StepAlone(backend(), cloth, scene, 1, /*measure=*/true).measured.contacts;
    }
    std::vector<Vector3d> positions = ReadState(backend(), cloth).positions_m;
    for (Vector3d& p : positions) {
      p = frame.rotation.conjugate() *
          (p - frame.shift_m - frame.velocity_m_per_s * (kSteps * step_s));
    }
    return positions;
  }

  // Positions are numbers of size up to `size_m`, rounded twice in each substep, which changes the
  // error C of a constraint by the same amount and, corrected, the positions at its ends; equal
  // substeps may round in the same way. Velocities enter as h u, which is smaller; but with two
  // steps the impulse of a contact changes the velocity by the rounding of a gap over h, which
  // friction and links carry on for the rest of the play: those of different sweeps add up at
  // random, and over the substeps to the power 3/2 of their number. A displacement moves on with
  // the cloth, whose neighbouring states part at most as fast as two pendulums of an edge's length
  // about their upper equilibrium: exp(sqrt(g / l) t).
  double Bound(const Scene& scene, double size_m) {
    const StepSettings& settings = scene.parameters.settings;
    const double time = kSteps * settings.time_step_s;
    const double growth = std::exp(std::sqrt(9.81 / scene.model->length_scale_m()) * time);
    const double substeps = double{kSteps} * settings.substeps;
    const bool keeps_gaps =
        PlanOf(scene).solver.has_two_steps && !scene.parameters.colliders.empty();
    const double of_gaps =
        keeps_gaps ? std::pow(substeps, 1.5) * std::sqrt(settings.max_iterations) : 0;
    return std::max(4 * substeps, of_gaps) * round_off() * size_m * growth;
  }

  void ExpectTheSameFromEveryFrame(const Scene& scene, const std::vector<Frame>& frames) {
    const std::vector<Vector3d> here = SeenFrom({.name = "here"}, scene);
    for (const Frame& frame : frames) {
      const double time = kSteps * scene.parameters.settings.time_step_s;
      const double size = 1 + frame.shift_m.norm() + time * frame.velocity_m_per_s.norm();
      const WorstOffender worst = FindWorst(SeenFrom(frame, scene), here);
      EXPECT_LE(worst.distance, Bound(scene, size)) << frame.name << ": " << worst.message;
    }
  }

  uint32_t contacts_ = 0;  // seen in all runs
};

TEST_P(FrameIndependence, OfAHangingClothInTheWind) {
  StructuralMaterial material;
  material.stretch_compliance_m_per_n = 1e-4;
  material.shear_stiffness_n_per_m = 1;
  Scene scene = Grid(6, 5, 0.5, 0.4, {0, 5}, material);
  Stir(scene, 0.5);
  scene.parameters.wind_m_per_s = Vector3d(3, 1, 2);
  scene.parameters.air_drag = 1;
  scene.parameters.air_lift = 0.5;
  scene.parameters.settings = PresetSettings(preset());
  scene.parameters.settings.tolerance = 0;
  scene.parameters.settings.max_iterations =
      std::min(20u, scene.parameters.settings.max_iterations);
  ExpectTheSameFromEveryFrame(scene, Frames());
}

// Falls onto a sphere with friction; in moving frames the sphere moves.
TEST_P(FrameIndependence, OfAClothOnASphere) {
  Scene scene = Grid(6, 6, 0.5, 0.5);
  scene.parameters.colliders = {SphereAt(Vector3d(0.25, -0.205, 0.23), 0.2)};
  scene.parameters.friction_static = 0.5;
  scene.parameters.friction_dynamic = 0.4;
  scene.parameters.settings = PresetSettings(preset());
  scene.parameters.settings.tolerance = 0;
  scene.parameters.settings.max_iterations =
      std::min(20u, scene.parameters.settings.max_iterations);
  ExpectTheSameFromEveryFrame(scene, Frames());
  EXPECT_GT(contacts_, 0u) << "it never touched the sphere";
}

DRAPE_PRESET_TEST_ON_EVERY_BACKEND(FrameIndependence);

}  // namespace
}  // namespace drape::test
