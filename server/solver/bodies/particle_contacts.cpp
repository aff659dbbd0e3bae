#include "server/solver/bodies/particle_contacts.h"

#include <algorithm>
#include <cmath>

#include "server/solver/bodies/rebound.h"
#include "server/solver/solver_constants.h"

namespace drape::bodies {

using Eigen::Vector3d;

void ParticleContacts::Begin() {
  for (const Contact& contact : contacts_) places_[contact.particle] = 0;
  contacts_.clear();
}

ParticleContacts::Contact& ParticleContacts::ContactOf(uint32_t particle) {
  uint32_t& place = places_[particle];
  if (place == 0) {
    contacts_.push_back({.particle = particle});
    place = static_cast<uint32_t>(contacts_.size());
  }
  return contacts_[place - 1];
}

std::vector<uint32_t> ParticleContacts::Pushed() const {
  std::vector<uint32_t> particles;
  for (const Contact& contact : contacts_) {
    if (contact.normal > 0) particles.push_back(contact.particle);
  }
  std::ranges::sort(particles);
  return particles;
}

void ParticleContacts::Predict(const PlacedCollider& body, const BodyNumbers& numbers,
                               const Particle& particle, const Vector3d& v) {
  const Vector3d& p = particle.start_m;
  const auto [distance, n] = body.SurfaceAtStart(p);
  const Vector3d relative = v - body.start.VelocityAt(p);
  // Both fall, but for a particle that is held.
  const double fall = particle.is_held() ? -numbers.gravity_m_per_s2.dot(n) : 0;
  const double rebound =
      ReboundSpeed(distance - numbers.thickness_m, relative.dot(n), fall, numbers);
  if (rebound > 0) ContactOf(particle.index).rebound = rebound;
}

void ParticleContacts::Apply(PlacedCollider& body, const Particle& particle,
                             const Vector3d& impulse, const Vector3d& arm_m, Vector3d& velocity) {
  velocity += impulse / particle.mass_kg;
  body.Push(-impulse, arm_m);
  last_impulse_ += impulse;
  if (!of_particles_.empty()) of_particles_[particle.index] += impulse;
  given_.impulse_n_s -= impulse;
  given_.angular_impulse_n_m_s -= arm_m.cross(impulse);
}

void ParticleContacts::Rub(PlacedCollider& body, const BodyNumbers& numbers,
                           const Particle& particle, Contact& contact, double normal,
                           const Vector3d& sliding, const Vector3d& arm_m, Vector3d& velocity) {
  const double speed = sliding.norm();
  Vector3d wanted = contact.tangent;
  if (speed > 0) {
    wanted -= sliding / (1 / particle.mass_kg + body.MobilityAlong(sliding / speed, arm_m));
  }
  const Vector3d tangent =
      LimitFriction(wanted, normal, numbers.friction_static, numbers.friction_dynamic);
  Apply(body, particle, tangent - contact.tangent, arm_m, velocity);
  contact.tangent = tangent;
}

double ParticleContacts::Solve(PlacedCollider& body, const BodyNumbers& numbers, double seconds,
                               const Particle& particle, Vector3d& u) {
  last_impulse_.setZero();
  const Vector3d& p = particle.start_m;
  const auto [distance, n] = body.SurfaceAtEnd(p + seconds * u);
  double gap = distance - numbers.thickness_m;
  const bool has_pushed = HasPushed(particle.index);
  if (gap >= 0 && !has_pushed) return 0;
  const double start_gap = body.SurfaceAtStart(p).distance_m - numbers.thickness_m;
  // Of what touched before, rounding of its place is no motion.
  const double touch = kTouchRoundOffs * round_off_ * p.cwiseAbs().sum();
  if (std::abs(start_gap) <= touch) gap = seconds * (u - body.MeanVelocity(p, seconds)).dot(n);
  if (gap >= 0 && !has_pushed) return 0;
  Contact& contact = ContactOf(particle.index);
  // From where both start, so that their angular momentum together stays as it is.
  const Vector3d arm_m = p - body.start.position_m;
  const auto velocity = [&]() -> Vector3d {
    return particle.is_held() ? body.VelocityAt(arm_m) : u;
  };
  const Vector3d before = velocity();
  const double floor = std::min(0.0, start_gap + kMaxDepenetrationSpeed_m_per_s * seconds);
  const double mobility = 1 / particle.mass_kg + body.MobilityAlong(n, arm_m);
  const double normal = std::max(contact.normal - (gap - floor) / (seconds * mobility), 0.0);
  Apply(body, particle, (normal - contact.normal) * n, arm_m, u);
  contact.normal = normal;
  if (numbers.friction_static > 0) {
    const Vector3d sliding = Tangential(u - body.MeanVelocity(p, seconds), n);
    Rub(body, numbers, particle, contact, normal, sliding, arm_m, u);
  }
  return (velocity() - before).norm();
}

void ParticleContacts::Correct(PlacedCollider& body, const BodyNumbers& numbers,
                               const Particle& particle, const Vector3d& p, Vector3d& v) {
  last_impulse_.setZero();
  if (!HasPushed(particle.index)) return;
  Contact& contact = ContactOf(particle.index);
  const Vector3d n = body.SurfaceAtEnd(p).outward;
  const Vector3d arm_m = p - body.end.position_m;
  const double change = contact.rebound - (v - body.end.VelocityAt(p)).dot(n);
  if (!(change > 0)) return;
  const double impulse = change / (1 / particle.mass_kg + body.MobilityAlong(n, arm_m));
  Apply(body, particle, impulse * n, arm_m, v);
  if (numbers.friction_static == 0) return;
  const Vector3d sliding = Tangential(v - body.end.VelocityAt(p), n);
  Rub(body, numbers, particle, contact, contact.normal + impulse, sliding, arm_m, v);
}

}  // namespace drape::bodies
