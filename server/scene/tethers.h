// Tethers: the largest distance of a particle from a pin, by the lengths along the cloth between
// them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/description.h"

namespace drape {

// |p - p_pin| <= length_m holds in every state in which the constraints hold.
struct Tether {
  uint32_t pin = 0;  // particle index
  double length_m = 0;
};

// The tethers of particle i are the entries offsets[i] .. offsets[i + 1] of `tethers`, in the order
// of their pins; pins have none. (Which pin is nearest differs between particles and between cloths
// that hold others, which share lanes.)
struct TetherSet {
  std::vector<uint32_t> offsets;  // [particle_count + 1]
  std::vector<Tether> tethers;
};

// Largest number per particle. More pins hardly ever add a bound that the nearest ones do not
// imply.
inline constexpr uint32_t kMaxTethersPerParticle = 4;

// For each free particle the nearest pins along constraints that cannot become longer (those of
// compliance 0 except struts, and joints of compliance 0, which have length 0), at most
// kMaxTethersPerParticle. A pin is left out if its bound follows from that of a nearer pin, given
// the pins' distance in the rest shape (triangle inequality). Paths do not lead through other pins,
// which may be moved apart. O(constraints * log) time.
TetherSet FindTethers(std::span<const Eigen::Vector3d> rest_positions_m,
                      std::span<const DistanceConstraint> constraints,
                      std::span<const PointJoint> joints, std::span<const uint32_t> pins);

}  // namespace drape
