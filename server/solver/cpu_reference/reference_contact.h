// Contact geometry and Coulomb friction of single particles. Pure functions.
#pragma once

#include <Eigen/Core>

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"

namespace drape {

struct ReferenceContact {
  double gap = 0;          // distance to the collider less the thickness, negative inside [m]
  Eigen::Vector3d normal;  // outward, unit
};

ReferenceContact ContactAt(const Collider& collider, double thickness_m, const Eigen::Vector3d& q);

// Accumulated impulse times inverse mass of one particle at one collider during a substep [m/s].
struct ContactImpulse {
  double normal = 0;  // >= 0
  Eigen::Vector3d tangential = Eigen::Vector3d::Zero();
};

// The contact with a collider at the pose of `motion` at its time 0: in its own frame the collider
// is as it was described.
ReferenceContact ContactAt(const Collider& collider, const RigidMotion& motion, double thickness_m,
                           const Eigen::Vector3d& q);

// How fast a particle that hits a collider is to leave it [m/s], from where it is and how fast
// before the substep, relative to the surface: `restitution` times the speed with which it arrives,
// as gravity makes it on the way to the surface. 0 where that is no faster than `slowest_m_per_s`,
// or where it approaches no faster than half of that.
double ReboundSpeed(const ReferenceContact& contact, const Eigen::Vector3d& velocity_m_per_s,
                    const Eigen::Vector3d& gravity_m_per_s2, double restitution,
                    double slowest_m_per_s);

// Coulomb's law on accumulated impulses: of `wanted`, which stops the sliding, what is within
// `friction` times the normal impulse.
Eigen::Vector3d FrictionImpulse(const Eigen::Vector3d& wanted, double normal_impulse,
                                double friction);

// How fast what has the dynamic friction has slid at least [m/s] (kSlipSubsteps). `slowest`:
// SlowestSlip.
double SlipSpeed(double friction_static, double normal_impulse, double slowest_m_per_s);

// Whether a particle with this velocity relative to the surface hits it: faster than gravity makes
// what rests, and not only because the surface is curved.
bool IsLanding(const Eigen::Vector3d& relative_m_per_s, const Eigen::Vector3d& normal,
               double slowest_m_per_s);

}  // namespace drape
