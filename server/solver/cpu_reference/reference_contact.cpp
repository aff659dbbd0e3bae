#include "server/solver/cpu_reference/reference_contact.h"

#include <algorithm>
#include <cmath>

#include "server/solver/solver_constants.h"

namespace drape {

ReferenceContact ContactAt(const Collider& collider, double thickness_m, const Eigen::Vector3d& q) {
  const SurfaceDistance surface = SurfaceOf(collider, q);
  return {surface.distance_m - thickness_m, surface.outward};
}

ReferenceContact ContactAt(const Collider& collider, const RigidMotion& motion, double thickness_m,
                           const Eigen::Vector3d& q) {
  ReferenceContact contact = ContactAt(collider, thickness_m, motion.DescribedAt(q));
  contact.normal = motion.rotation * contact.normal;
  return contact;
}

double ReboundSpeed(const ReferenceContact& contact, const Eigen::Vector3d& velocity_m_per_s,
                    const Eigen::Vector3d& gravity_m_per_s2, double restitution,
                    double slowest_m_per_s) {
  const double approach = -velocity_m_per_s.dot(contact.normal);
  const double gained = -2 * gravity_m_per_s2.dot(contact.normal) * std::max(contact.gap, 0.0);
  const double arrival = std::sqrt(std::max(approach * approach + gained, 0.0));
  return std::min(arrival, 2 * approach) > slowest_m_per_s ? restitution * arrival : 0;
}

Eigen::Vector3d FrictionImpulse(const Eigen::Vector3d& wanted, double normal_impulse,
                                double friction) {
  const double size = wanted.norm();
  const double limit = friction * normal_impulse;
  return size <= limit ? wanted : Eigen::Vector3d(wanted * (limit / size));
}

double SlipSpeed(double friction_static, double normal_impulse, double slowest_m_per_s) {
  return std::min(kSlipSpeed_m_per_s,
                  kSlipSubsteps * friction_static * std::max(normal_impulse, slowest_m_per_s));
}

bool IsLanding(const Eigen::Vector3d& relative_m_per_s, const Eigen::Vector3d& normal,
               double slowest_m_per_s) {
  const double approach = -relative_m_per_s.dot(normal);
  return approach > slowest_m_per_s + kGrazingSine * relative_m_per_s.norm();
}

}  // namespace drape
