// Contacts of bodies of any shape with colliders and with each other, and their joints: those of
// all bodies that touch or hang together at once (contact_problem.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "server/solver/bodies/body_joints.h"
#include "server/solver/bodies/body_numbers.h"
#include "server/solver/bodies/body_points.h"
#include "server/solver/bodies/contact_problem.h"
#include "server/solver/bodies/convex_pair.h"
#include "server/solver/bodies/island_bodies.h"
#include "server/solver/bodies/momentum.h"
#include "server/solver/bodies/placed_collider.h"
#include "server/solver/step_impulses.h"

namespace drape::bodies {

// Where at least one of two colliders is a body: the spots of convex solids on each other
// (convex_pair.h), else the points of each solid (body_points.h) against the surface of the
// other one. The contacts of two colliders are a patch: it sticks as a whole, or slides as a whole.
// The thickness of the cloth has no part in it.
class PatchContacts {
 public:
  explicit PatchContacts(const std::vector<PlacedCollider>& placed);

  // A substep begins: nothing touches.
  void Begin(const std::vector<PlacedCollider>& placed, double seconds);
  // What nothing goes through at the end of the substep, and joints hold. Returns the largest
  // change of the velocity of a body where it touches or hangs [m/s].
  double Solve(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers);
  // At the end of the substep: velocities after all impulses of the substep, rebounds included.
  void Correct(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers);

  // What bodies and joints gave to each collider so far, about its centre or pivot.
  const std::vector<ColliderImpulse>& given() const { return given_; }

 private:
  // The points of `solid` at the surface of `other`, or the spots of both on each other: contacts
  // first to first + spot_count.
  struct Face {
    size_t solid = 0;
    size_t other = 0;
    size_t patch = 0;
    size_t first = 0;
    size_t spot_count = 0;
    std::optional<ConvexPair> pair{};
    bool is_never_near = false;  // in the pose that was looked at last
    bool keeps_spots = false;    // those that were found last in the substep under way
  };
  struct Contact {
    size_t face = 0;
    bool touches = false;  // in the substep under way
    // As described, on the solid.
    PairSpot spot{.on_first = Eigen::Vector3d::Zero(), .on_second = Eigen::Vector3d::Zero()};
    double gap = 0;
    double floor = 0;            // of the gap
    double rebound_m_per_s = 0;  // only in the end
    Eigen::Vector3d n = Eigen::Vector3d::Zero();
    Eigen::Vector3d arm_of_solid = Eigen::Vector3d::Zero();
    Eigen::Vector3d arm_of_other = Eigen::Vector3d::Zero();
    double least_m_per_s = 0;  // along n, in the substep
    // On the solid, as it is applied now [N s, N m s].
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment_on_solid = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment_on_other = Eigen::Vector3d::Zero();
    // What was found last, of this substep or the one before, for kSubstep and kEnd: the solver
    // starts there.
    bool slides = false;
    std::array<Eigen::Vector3d, 2> guesses{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  };
  // What touches or hangs together.
  struct Island {
    std::vector<size_t> contacts;
    std::vector<size_t> joints;
  };

  // Where contacts and joints are, at the end of the substep. Returns whether a contact breaks its
  // floor or holds apart what is apart, or a joint is off.
  bool Look(const std::vector<PlacedCollider>& placed, When when);
  void LookAt(const std::vector<PlacedCollider>& placed, When when, Face& face);
  // Where the points or spots of a face are now.
  void PlacePoints(const std::vector<PlacedCollider>& placed, const Face& face);
  void PlaceSpots(const std::vector<PlacedCollider>& placed, Face& face);
  double NearOf(const std::vector<PlacedCollider>& placed, const Face& face) const;
  // Of the surfaces at a contact, at the start or at the end of the substep.
  SurfaceDistance GapAtStart(const std::vector<PlacedCollider>& placed,
                             const Contact& contact) const;
  SurfaceDistance GapAtEnd(const std::vector<PlacedCollider>& placed, const Contact& contact) const;
  double SlackOf(const std::vector<PlacedCollider>& placed, const Face& face) const;
  // Of the solid over the other at the contact, at the moment.
  Eigen::Vector3d VelocityOf(const std::vector<PlacedCollider>& placed,
                             const Contact& contact) const;
  void FindRebounds(const std::vector<PlacedCollider>& placed, const BodyNumbers& numbers);

  // Of all impulses at the present arms.
  void FindMoments();
  // Sums of the impulses of all contacts and joints, by collider.
  std::vector<Momentum> Sums() const;
  // Rounds of Look and Resolve until nothing is off. Returns whether that is so.
  bool Settle(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers);
  // Takes all impulses away: nothing touches, no rope is taut.
  void DropImpulses(std::vector<PlacedCollider>& placed);
  // Shifts bodies to the nearest places where joints hold and nothing is inside another one.
  void SettlePlaces(std::vector<PlacedCollider>& placed);
  void ShiftIsland(std::vector<PlacedCollider>& placed, const Island& island) const;
  // Takes all impulses away, finds new ones, applies them.
  void Resolve(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers, When when);
  std::vector<Island> Islands(const std::vector<PlacedCollider>& placed) const;
  ProblemSides SidesOf(const Contact& contact, IslandBodies& bodies) const;
  void ResolveIsland(const std::vector<PlacedCollider>& placed, const Island& island,
                     const std::vector<Momentum>& pushed, const BodyNumbers& numbers, When when);
  // The largest change across contacts and joints since the motions `before` [m/s].
  double LargestChange(const std::vector<RigidMotion>& before) const;

  BodyJoints joints_;
  std::vector<BodyPoints> points_;  // [collider_count]
  std::vector<double> reaches_m_;   // [collider_count] of its points, from its pivot
  std::vector<Face> faces_;
  std::vector<Contact> contacts_;
  std::vector<ColliderImpulse> given_;   // [collider_count]
  std::vector<Eigen::Vector3d> places_;  // of one face
  // The motions of all bodies as the last Solve left them.
  std::vector<RigidMotion> solved_;
  // In the substep under way: nothing was off in the end; places are shifted instead.
  bool is_settled_ = false;
  bool shifts_ = false;
  double seconds_ = 0;
};

}  // namespace drape::bodies
