// The deviations of a motion from the right one, from positions and velocities alone: the same
// measure for every backend and for other programs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tests/bench/accuracy/accuracy_scenes.h"

namespace drape::bench {

// NaN: not defined for this scene, or the motion was not finite.
struct Deviations {
  static Deviations NotDefined();

  // (b) |l - l0| / l0 over the inextensible constraints: the largest of any frame of the window,
  // and the root mean square over constraints and frames.
  double max_strain = 0;
  double rms_strain = 0;
  // (a) Distance to the reference at the end, over the free particles.
  double rms_position_m = 0;
  double max_position_m = 0;
  // (c) (E - E0) / (m g l) of largest magnitude at any frame, m the mass of the free particles;
  // negative: lost. Scenes without contacts and damping.
  double energy_drift = 0;
  // (d) Largest penetration at any frame: of a particle, and separately of the middle of an edge: a
  // chord of length l on radius R sinks by l^2 / 8R though both its ends are outside. Scenes with
  // colliders.
  double max_penetration_m = 0;
  double midpoint_penetration_m = 0;
};

// Watches one motion, frame by frame.
class Observer {
 public:
  // The scene must outlive the observer; `reference_m`: positions at the end, or empty.
  Observer(const AccuracyScene& scene, const std::vector<Eigen::Vector3d>& reference_m);

  // Frame k is at time k / 60 s; frame 0 is the start.
  void Observe(uint32_t frame, const ParticleState& state);
  // After the last frame.
  Deviations Result() const;

 private:
  void ObserveStrain(const ParticleState& state);
  void ObservePenetration(const ParticleState& state);
  double Energy_j(const ParticleState& state) const;

  const AccuracyScene& scene_;
  const std::vector<Eigen::Vector3d>& reference_m_;
  Deviations worst_;
  double strain_sq_sum_ = 0;
  double strain_count_ = 0;
  double start_energy_j_ = 0;
  double energy_scale_j_ = 0;  // m g l
  bool is_finite_ = true;
};

// Root mean square and largest distance over the free particles.
struct PositionError {
  double rms_m = 0;
  double max_m = 0;
};
PositionError ComparePositions(const SceneModel& model, const std::vector<Eigen::Vector3d>& a,
                               const std::vector<Eigen::Vector3d>& b);

// The depth of a point inside the solid colliders, thickness included; 0 outside. Planes and
// spheres only: the scenes of this benchmark have no others.
double Penetration_m(const ClothParameters& parameters, const Eigen::Vector3d& point_m);

}  // namespace drape::bench
