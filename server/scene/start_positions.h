// The start of a cloth whose described positions violate its own lengths.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/description.h"
#include "server/scene/tethers.h"

namespace drape {

// Demands of rigid constraints and joints (compliance 0) on positions.
struct LengthDemands {
  std::span<const double> inverse_masses_per_kg;  // [particle_count], 0 for pins
  std::span<const DistanceConstraint> constraints;
  // [constraint_count] by which the constraints are to be visited: their places in the description.
  std::span<const uint32_t> constraint_sources;
  std::span<const PointJoint> joints;
  double length_scale_m = 1;  // errors of joints are relative to it
  const TetherSet& tethers;
};

// Errors of the demands at some positions, relative to the lengths: |C| / l0, for ropes and struts
// only the forbidden part.
struct LengthErrors {
  double max = 0;
  double rms = 0;
};
LengthErrors FindLengthErrors(const LengthDemands& demands,
                              std::span<const Eigen::Vector3d> positions_m);

// Errors up to which positions are kept: a cloth that is being simulated may have them too.
// Smaller: states from a simulation would be changed. Larger: a link with the error C leaves its
// first substep, of duration h, with the speed C/h, which throws the cloth about.
inline constexpr double kMaxStartError = 0.25;
inline constexpr double kMaxStartRmsError = 0.02;
bool NeedsRestoring(const LengthErrors& errors);

// Errors at which RestoreLengths stops: for 0.1 m and substeps of 0.1 ms, 1 mm/s.
inline constexpr double kRestoredError = 1e-6;

// Moves free particles to positions near by where the demands are met: within reach of the pins
// (tethers), by Gauss-Seidel sweeps (Bender et al. 2009, section 3.2, without velocities), then by
// Newton's method for the least motion, sum m |dx|^2. If that ends where no small motion helps (all
// particles on a line), it is repeated from slightly disordered positions, the same every time.
// Demands that contradict each other are met as well as possible; so are those of cloths so large
// that the work is cut off after some seconds. Returns the errors that are left, never larger (RMS)
// than before. `interruption`: asked between sweeps; null: nobody is. Any thread.
LengthErrors RestoreLengths(const LengthDemands& demands, std::vector<Eigen::Vector3d>& positions_m,
                            Interruption* interruption = nullptr);

}  // namespace drape
