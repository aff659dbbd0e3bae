// Where impulses cannot hold joints: places alone are corrected (method.md, "What turns too far").
#include <algorithm>
#include <cmath>

#include "server/solver/bodies/patch_contacts.h"

namespace drape::bodies {

using Eigen::Vector3d;

namespace {

// Most rounds in which places are shifted, and the farthest turn of a body in one of them [-, rad].
// Smaller turns: more rounds; larger: what is linear in one says nothing of where it ends.
constexpr int kMostShifts = 40;
constexpr double kMostTurn_rad = 0.5;

}  // namespace

void PatchContacts::DropImpulses(std::vector<PlacedCollider>& placed) {
  const std::vector<Momentum> sums = Sums();
  for (size_t c = 0; c < placed.size(); ++c) placed[c].Change(-sums[c].linear, -sums[c].angular);
  for (Contact& contact : contacts_) {
    contact.touches = false;
    contact.impulse.setZero();
  }
  joints_.DropImpulses();
  FindMoments();
}

void PatchContacts::SettlePlaces(std::vector<PlacedCollider>& placed) {
  for (int round = 0; round < kMostShifts && Look(placed, When::kShift); ++round) {
    joints_.FindDemands(placed, When::kShift);
    for (const Island& island : Islands(placed)) ShiftIsland(placed, island);
  }
}

// The least way, by mass and inertia, along which joints close and nothing is inside another one:
// the same problem as that of impulses, for bodies at rest.
void PatchContacts::ShiftIsland(std::vector<PlacedCollider>& placed, const Island& island) const {
  IslandBodies bodies(placed, When::kShift);
  std::vector<ProblemContact> contacts;
  std::vector<ProblemJoint> joints;
  for (const size_t i : island.contacts) {
    const Contact& contact = contacts_[i];
    ProblemContact& its = contacts.emplace_back(SidesOf(contact, bodies));
    its.free_m_per_s.setZero();
    its.n = contact.n;
    its.least_m_per_s = -(contact.gap - contact.floor) / seconds_;
  }
  for (const size_t j : island.joints) {
    const BodyJoints::Joint& joint = joints_.joints()[j];
    ProblemSides sides = bodies.SidesOf(joint);
    sides.free_m_per_s.setZero();
    if (joint.described->is_rope()) {
      contacts.push_back({sides, Vector3d::UnitX(), joint.demanded_m_per_s.x()});
    } else {
      joints.push_back({sides, joint.demanded_m_per_s});
    }
  }
  ContactProblem problem(bodies.colliders().size());
  problem.contacts() = std::move(contacts);
  problem.joints() = std::move(joints);
  problem.SolveByPatches(0, 0);
  for (size_t b = 0; b < bodies.colliders().size(); ++b) {
    PlacedCollider& its = placed[bodies.colliders()[b]];
    const Eigen::VectorXd y = problem.change().segment<6>(static_cast<Eigen::Index>(6 * b));
    const Vector3d way_m = seconds_ / std::sqrt(its.body->mass_kg()) * y.head<3>();
    const Vector3d turn_rad = seconds_ * (bodies.root(b) * y.tail<3>());
    const double share = std::min(1.0, kMostTurn_rad / turn_rad.norm());
    its.Shift(share * way_m, share * turn_rad);
  }
}

}  // namespace drape::bodies
