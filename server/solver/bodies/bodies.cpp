#include "server/solver/bodies/bodies.h"

#include <algorithm>
#include <cmath>

#include "server/core/check.h"
#include "server/scene/body_mass.h"
#include "server/scene/distance_map.h"
#include "server/solver/bodies/patch_contacts.h"
#include "server/solver/bodies/point_contacts.h"
#include "server/solver/solver_constants.h"

namespace drape {

using Eigen::Vector3d;

namespace {

// The farthest that the solid reaches from its centre of mass [m].
double RadiusOf(const Collider& collider, const Vector3d& centre_m) {
  if (const auto map = MapOf(collider)) return map->moments().radius_m + map->error_bound_m();
  const bodies::BodyPoints points = bodies::PointsOf(collider);
  double farthest = 0;
  for (const Vector3d& p : points.places_m) farthest = std::max(farthest, (p - centre_m).norm());
  return farthest + points.radius_m;
}

bool IsFinite(const RigidMotion& motion) {
  return motion.position_m.allFinite() && motion.velocity_m_per_s.allFinite() &&
         motion.angular_velocity_rad_per_s.allFinite() && motion.rotation.coeffs().allFinite();
}

bool IsRunaway(const RigidMotion& motion) {
  return motion.position_m.cwiseAbs().maxCoeff() > kMaxCoordinate_m ||
         motion.velocity_m_per_s.norm() > kMaxSpeed_m_per_s ||
         motion.angular_velocity_rad_per_s.norm() > kMaxTurn_rad_per_s;
}

}  // namespace

Bodies::Bodies() = default;
Bodies::Bodies(Bodies&& other) noexcept = default;
Bodies& Bodies::operator=(Bodies&& other) noexcept = default;
Bodies::~Bodies() = default;

Bodies::Bodies(std::span<const Collider> colliders, std::span<const RigidMotion> motions,
               const BodyNumbers& numbers, size_t particle_count, double round_off)
    : numbers_(numbers) {
  if (!HasBodies(colliders)) return;
  DRAPE_CHECK(motions.size() == colliders.size(), "bodies have motions, and so all colliders");
  for (uint32_t c = 0; c < colliders.size(); ++c) {
    bodies::PlacedCollider& placed = placed_.emplace_back();
    placed.collider = &colliders[c];
    placed.motion = placed.start = placed.end = motions[c];
    if (!colliders[c].is_body()) continue;
    const BodyMass mass = MassOf(colliders[c]);
    placed.body.emplace(mass, motions[c]);
    bodies_.push_back({c, RadiusOf(colliders[c], mass.centre_m) + numbers.thickness_m,
                       bodies::ParticleContacts(particle_count, round_off)});
  }
  const auto is_lone_ball = [](const bodies::PlacedCollider& placed) {
    return !placed.body ||
           (placed.collider->kind() == ShapeKind::kSphere && placed.collider->joints.empty());
  };
  if (std::ranges::all_of(placed_, is_lone_ball)) {
    points_ = std::make_unique<bodies::PointContacts>(placed_);
  } else {
    patches_ = std::make_unique<bodies::PatchContacts>(placed_);
  }
}

const Vector3d& Bodies::CentreAtStart(size_t k) const {
  return placed_[bodies_[k].collider].start.position_m;
}

const Vector3d& Bodies::CentreAtEnd(size_t k) const {
  return placed_[bodies_[k].collider].end.position_m;
}

double Bodies::SpeedAtStart(size_t k) const {
  return placed_[bodies_[k].collider].start.velocity_m_per_s.norm();
}

void Bodies::Begin(double begin_s, double seconds) {
  if (empty()) return;
  seconds_ = seconds;
  for (bodies::PlacedCollider& placed : placed_) {
    placed.Begin(begin_s, seconds, numbers_.gravity_m_per_s2);
  }
  for (Body& body : bodies_) body.contacts.Begin();
  if (points_) points_->Begin(placed_, numbers_, seconds);
  if (patches_) patches_->Begin(placed_, seconds);
}

void Bodies::Predict(size_t k, const bodies::Particle& particle, const Vector3d& v) {
  Body& body = bodies_[k];
  body.contacts.Predict(placed_[body.collider], numbers_, particle, v);
}

double Bodies::Solve(size_t k, const bodies::Particle& particle, Vector3d& u) {
  Body& body = bodies_[k];
  return body.contacts.Solve(placed_[body.collider], numbers_, seconds_, particle, u);
}

SurfaceDistance Bodies::SurfaceOfBody(size_t k, const Vector3d& place) const {
  SurfaceDistance surface = placed_[bodies_[k].collider].SurfaceAtEnd(place);
  surface.distance_m -= numbers_.thickness_m;
  return surface;
}

double Bodies::SolveColliders() {
  if (points_) return points_->Solve(placed_, numbers_);
  if (patches_) return patches_->Solve(placed_, numbers_);
  return 0;
}

void Bodies::End() {
  for (bodies::PlacedCollider& placed : placed_) placed.End();
}

std::vector<uint32_t> Bodies::PushedBy(size_t k) const {
  return bodies_[k].contacts.Pushed();
}

void Bodies::Correct(size_t k, const bodies::Particle& particle, const Vector3d& p, Vector3d& v) {
  Body& body = bodies_[k];
  body.contacts.Correct(placed_[body.collider], numbers_, particle, p, v);
}

void Bodies::CorrectColliders() {
  if (points_) points_->Correct(placed_, numbers_);
  if (patches_) patches_->Correct(placed_, numbers_);
}

std::shared_ptr<const std::vector<BodyState>> Bodies::States() const {
  auto states = std::make_shared<std::vector<BodyState>>();
  for (const Body& body : bodies_) {
    states->push_back({body.collider, placed_[body.collider].body->motion()});
  }
  return states;
}

FaultReason Bodies::Fault() const {
  FaultReason fault = FaultReason::kNone;
  for (const Body& body : bodies_) {
    const RigidMotion& motion = placed_[body.collider].body->motion();
    if (!IsFinite(motion)) return FaultReason::kNotFinite;
    if (IsRunaway(motion)) fault = FaultReason::kRunaway;
  }
  return fault;
}

void Bodies::KeepContacts() {
  for (Body& body : bodies_) body.contacts.KeepOfParticles();
}

void Bodies::AddContacts(std::vector<ParticleImpulse>& contacts) const {
  for (const Body& body : bodies_) {
    const std::vector<Vector3d>& given = body.contacts.of_particles();
    for (uint32_t i = 0; i < given.size(); ++i) {
      if (!given[i].isZero(0)) contacts.push_back({i, body.collider, given[i]});
    }
  }
  SortContacts(contacts);
}

void Bodies::AddImpulses(std::vector<ColliderImpulse>& given) const {
  const auto add = [&](size_t c, const ColliderImpulse& impulse) {
    given[c].impulse_n_s += impulse.impulse_n_s;
    given[c].angular_impulse_n_m_s += impulse.angular_impulse_n_m_s;
  };
  for (const Body& body : bodies_) add(body.collider, body.contacts.given());
  const auto add_all = [&](const std::vector<ColliderImpulse>& its) {
    for (size_t c = 0; c < its.size(); ++c) {
      if (!placed_[c].body) add(c, its[c]);
    }
  };
  if (points_) add_all(points_->given());
  if (patches_) add_all(patches_->given());
}

}  // namespace drape
