// The rigid bodies among the colliders of one cloth during a step (server/solver/method.md,
// "Bodies"). For the backends that step one cloth after the other, in double precision.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/solver/bodies/body_numbers.h"
#include "server/solver/bodies/particle_contacts.h"
#include "server/solver/bodies/placed_collider.h"
#include "server/solver/step_impulses.h"
#include "server/solver/step_report.h"

namespace drape {

namespace bodies {
class PatchContacts;
class PointContacts;
}  // namespace bodies

// The calls of a substep in this order: Begin, Predict, any number of Solve and SolveColliders,
// End, Correct and CorrectColliders. Contacts with particles are asked for by the backend, of those
// within reach.
class Bodies {
 public:
  // None.
  Bodies();
  // At the start of a step; one motion per collider. The colliders outlive it. `round_off`: as in
  // ParticleContacts.
  Bodies(std::span<const Collider> colliders, std::span<const RigidMotion> motions,
         const BodyNumbers& numbers, size_t particle_count, double round_off);
  Bodies(Bodies&& other) noexcept;
  Bodies& operator=(Bodies&& other) noexcept;
  ~Bodies();

  size_t size() const { return bodies_.size(); }
  bool empty() const { return bodies_.empty(); }
  // Of body k: its collider, ascending.
  uint32_t ColliderOf(size_t k) const { return bodies_[k].collider; }
  // Places of particles within this of the centre may touch it [m].
  double ReachOf(size_t k) const { return bodies_[k].reach_m; }
  const Eigen::Vector3d& CentreAtStart(size_t k) const;
  const Eigen::Vector3d& CentreAtEnd(size_t k) const;
  double SpeedAtStart(size_t k) const;  // of its centre [m/s]

  void Begin(double begin_s, double seconds);
  // Only where HasRebounds.
  void Predict(size_t k, const bodies::Particle& particle, const Eigen::Vector3d& v);
  bool HasRebounds() const { return numbers_.restitution > 0; }
  const BodyNumbers& numbers() const { return numbers_; }
  double seconds() const { return seconds_; }  // of the substep
  // Returns the change of u [m/s]; with a held particle that of the body there.
  double Solve(size_t k, const bodies::Particle& particle, Eigen::Vector3d& u);
  // Of body k where it ends, at `place`: how far the surface of the cloth is from it, and its
  // outward normal.
  SurfaceDistance SurfaceOfBody(size_t k, const Eigen::Vector3d& place) const;
  // The largest change of a body's velocity [m/s].
  double SolveColliders();
  void End();
  bool HasPushed(size_t k, uint32_t particle) const {
    return bodies_[k].contacts.HasPushed(particle);
  }
  // Particles that have pushed body k in this substep, ascending.
  std::vector<uint32_t> PushedBy(size_t k) const;
  void Correct(size_t k, const bodies::Particle& particle, const Eigen::Vector3d& p,
               Eigen::Vector3d& v);
  void CorrectColliders();
  // What the last call of Solve or Correct with body k gave to its particle [N s].
  const Eigen::Vector3d& LastImpulse(size_t k) const { return bodies_[k].contacts.last_impulse(); }

  // The motions of collider c in the substep under way, and after End.
  const RigidMotion& MotionAtEnd(size_t c) const { return placed_[c].end; }
  const RigidMotion& MotionAtStart(size_t c) const { return placed_[c].start; }
  // After a step: what the report tells, and its fault.
  std::shared_ptr<const std::vector<BodyState>> States() const;
  FaultReason Fault() const;
  // What the cloth gave to bodies, and bodies to colliders, in `given` [collider_count].
  void AddImpulses(std::vector<ColliderImpulse>& given) const;
  // Before a step: AddContacts has something to tell after it.
  void KeepContacts();
  // What bodies gave to particles, added to `contacts` and sorted.
  void AddContacts(std::vector<ParticleImpulse>& contacts) const;

 private:
  struct Body {
    uint32_t collider = 0;
    double reach_m = 0;
    bodies::ParticleContacts contacts;
  };

  std::vector<bodies::PlacedCollider> placed_;  // [collider_count]
  std::vector<Body> bodies_;
  BodyNumbers numbers_;
  // One of both, or none without bodies: balls without joints touch everything in one point.
  std::unique_ptr<bodies::PointContacts> points_;
  std::unique_ptr<bodies::PatchContacts> patches_;
  double seconds_ = 0;
};

}  // namespace drape
