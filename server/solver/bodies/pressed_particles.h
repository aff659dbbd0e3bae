// Particles between a body and another collider (server/solver/method.md, "Bodies"): what a
// collider supports is to the body as heavy as that. One text for all backends; `Cloth` is a
// backend's view:
//   bodies::Particle ParticleOf(i), of its own mass; Vector3d Velocity(i), void SetVelocity(i, u)
//   bool HasColliders(), beside bodies
//   void Settle(i): solves its contacts with them
//   Support SupportOf(i, place, n): of those that push it, the one most opposite to n
//   void Load(i, support, place, impulse): the support has taken this impulse on the particle
//   void PassOn(k, i): a held particle has taken the last impulse
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/solver/bodies/bodies.h"

namespace drape::bodies {

// What pushes a particle: a collider, in the numbering of the backend.
struct Support {
  bool exists = false;
  size_t collider = 0;
  Eigen::Vector3d n = Eigen::Vector3d::Zero();  // outward, at the particle
  double grip_m_per_s = 0;                      // of sliding its friction can still stop
};

// A body presses a particle against its support, whatever the friction, where their normals are
// this much opposite [-]: 20 degrees. Links hold what friction would not. Larger: balls sink in
// between the particles of coarse cloths; smaller: what could slip away is held.
inline constexpr double kOpposite = 0.94;
// Rounds over the particles that a body presses, in each sweep [-], and the change of a round
// relative to that of the first below which they end. Fewer: the first particles carry all.
inline constexpr int kPressedRounds = 8;
inline constexpr double kPressedAgreement = 1e-3;

// Whether a body that pushes along n presses against the support: within its cone of friction, too.
inline bool Presses(const Support& support, const Eigen::Vector3d& n, double friction) {
  return support.exists && -n.dot(support.n) >= std::min(kOpposite, 1 / std::hypot(1, friction));
}

// Whether a particle moves along its support by no more than gravity does in a substep. What links
// pull along it goes on with its own mass: as a wedge of the mass of its support it would throw the
// body.
template <class Cloth>
bool IsStill(const Bodies& bodies, const Cloth& cloth, const Support& support,
             const Eigen::Vector3d& place, const Eigen::Vector3d& velocity) {
  const Eigen::Vector3d relative = velocity - cloth.VelocityOfSupport(support, place);
  const double most = bodies.seconds() * bodies.numbers().gravity_m_per_s2.norm();
  return Tangential(relative, support.n).norm() <= most;
}

// One sweep over one body and the particles that are offered to it.
template <class Cloth>
class ParticleSweep {
 public:
  ParticleSweep(Bodies& bodies, size_t k, Cloth& cloth) : bodies_(bodies), k_(k), cloth_(cloth) {}

  // Returns the change of velocity [m/s].
  double Solve(uint32_t i) {
    const Particle particle = cloth_.ParticleOf(i);
    Eigen::Vector3d u = cloth_.Velocity(i);
    if (particle.is_held() || !cloth_.HasColliders()) return SolveAs(particle, u);
    const double way_m = bodies_.seconds() * u.norm();
    const double gap = bodies_.SurfaceOfBody(k_, PlaceOf(particle, u)).distance_m;
    if (gap >= way_m && !bodies_.HasPushed(k_, i)) return 0;
    cloth_.Settle(i);
    if (IsPressed(particle)) return Press(particle);
    u = cloth_.Velocity(i);
    const double change = SolveAs(particle, u);
    if (change == 0) return 0;
    // Up to where a support stops it; from there on it is pressed.
    cloth_.Settle(i);
    return std::max(change, IsPressed(particle) ? Press(particle) : 0);
  }

  // Once more those that are pressed: all carry what the first ones met.
  void Finish() {
    for (int round = 1; round < kPressedRounds; ++round) {
      double change = 0;
      for (const uint32_t i : pressed_) {
        const Particle particle = cloth_.ParticleOf(i);
        if (IsPressed(particle)) change = std::max(change, Press(particle, false));
      }
      if (!(change > kPressedAgreement * first_change_)) return;
    }
  }

 private:
  Eigen::Vector3d PlaceOf(const Particle& particle, const Eigen::Vector3d& u) const {
    return particle.start_m + bodies_.seconds() * u;
  }
  Support SupportOf(const Particle& particle) const {
    const Eigen::Vector3d place = PlaceOf(particle, cloth_.Velocity(particle.index));
    return cloth_.SupportOf(particle.index, place, bodies_.SurfaceOfBody(k_, place).outward);
  }
  bool IsPressed(const Particle& particle) const {
    const Eigen::Vector3d place = PlaceOf(particle, cloth_.Velocity(particle.index));
    const Eigen::Vector3d n = bodies_.SurfaceOfBody(k_, place).outward;
    const Support support = cloth_.SupportOf(particle.index, place, n);
    return Presses(support, n, bodies_.numbers().friction_static) &&
           IsStill(bodies_, cloth_, support, place, cloth_.Velocity(particle.index));
  }
  double SolveAs(const Particle& particle, Eigen::Vector3d& u) {
    const double change = bodies_.Solve(k_, particle, u);
    if (change == 0) return 0;
    cloth_.SetVelocity(particle.index, u);
    if (particle.is_held()) cloth_.PassOn(k_, particle.index);
    return change;
  }
  double Press(Particle particle, bool is_first = true) {
    const uint32_t i = particle.index;
    Eigen::Vector3d u = cloth_.Velocity(i);
    const Support support = SupportOf(particle);
    particle.mass_kg = std::numeric_limits<double>::infinity();
    const double change = bodies_.Solve(k_, particle, u);
    if (change == 0) return 0;
    cloth_.Load(i, support, PlaceOf(particle, u), bodies_.LastImpulse(k_));
    // With this load the support holds more: what links have pulled it by need not be what moves
    // the body.
    cloth_.Settle(i);
    if (is_first) {
      pressed_.push_back(i);
      first_change_ = std::max(first_change_, change);
    }
    return change;
  }

  Bodies& bodies_;
  const size_t k_;
  Cloth& cloth_;
  std::vector<uint32_t> pressed_;
  double first_change_ = 0;
};

// At the end of the substep, when particle i is at p. Pressed, it moves as its support lets it:
//   Vector3d VelocityOfSupport(support, p)
template <class Cloth>
void CorrectParticle(Bodies& bodies, size_t k, uint32_t i, const Eigen::Vector3d& p, Cloth& cloth) {
  Particle particle = cloth.ParticleOf(i);
  Eigen::Vector3d v = cloth.Velocity(i);
  if (!particle.is_held() && cloth.HasColliders()) {
    const Eigen::Vector3d n = bodies.SurfaceOfBody(k, p).outward;
    const Support support = cloth.SupportOf(i, p, n);
    if (Presses(support, n, bodies.numbers().friction_static) &&
        IsStill(bodies, cloth, support, p, v)) {
      const Eigen::Vector3d of_support = cloth.VelocityOfSupport(support, p);
      const Eigen::Vector3d relative = v - of_support;
      const double away = std::max(relative.dot(support.n), 0.0);
      const Eigen::Vector3d sliding = Tangential(relative, support.n);
      const double speed = sliding.norm();
      const double left = speed > support.grip_m_per_s ? 1 - support.grip_m_per_s / speed : 0;
      v = of_support + away * support.n + left * sliding;
      particle.mass_kg = std::numeric_limits<double>::infinity();
      bodies.Correct(k, particle, p, v);
      return cloth.Load(i, support, p, bodies.LastImpulse(k));
    }
  }
  bodies.Correct(k, particle, p, v);
  cloth.SetVelocity(i, v);
  if (particle.is_held()) cloth.PassOn(k, i);
}

}  // namespace drape::bodies
