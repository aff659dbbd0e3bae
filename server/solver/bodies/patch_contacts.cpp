#include "server/solver/bodies/patch_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "server/solver/bodies/rebound.h"
#include "server/solver/solver_constants.h"

namespace drape::bodies {

using Eigen::Vector3d;

namespace {

// Most rounds in which turns of the bodies and impulses are brought together [-].
constexpr int kMostRounds = 6;
// Impulses of joints that act where the substep starts make the mean motion faster by 1/cos(a/2) of
// a turn by a; they have lost hold of what they make faster than this [-]: 0.93 rad.
constexpr double kMostEnergyOfJoints = 1.25;
// Energy that the solver's agreement may add, of what the impulses do [-].
constexpr double kEnergyRounding = 1e-9;

// Of all bodies that are under way [J].
double KineticEnergyOf(const std::vector<PlacedCollider>& placed) {
  double energy = 0;
  for (const PlacedCollider& each : placed) {
    if (!each.body) continue;
    const Vector3d& rate = each.body->motion().angular_velocity_rad_per_s;
    energy += each.body->mass_kg() * each.body->motion().velocity_m_per_s.squaredNorm() / 2 +
              each.body->angular_momentum().dot(rate) / 2;
  }
  return energy;
}

// Nothing of its own but the centre touches.
bool IsBall(const Collider& collider) {
  return collider.kind() == ShapeKind::kSphere;
}

// The largest s in [0, 1] with a s^2 + b s + c <= 0, where a >= 0; 0 if there is none.
double LargestShare(double a, double b, double c) {
  if (a + b + c <= 0) return 1;
  if (c >= 0) return 0;
  // One root is positive; in the form without a difference of equals.
  const double root = std::sqrt(std::max(b * b - 4 * a * c, 0.0));
  return std::clamp(b > 0 ? -2 * c / (b + root) : (root - b) / (2 * a), 0.0, 1.0);
}

}  // namespace

PatchContacts::PatchContacts(const std::vector<PlacedCollider>& placed)
    : joints_(placed), given_(placed.size()) {
  for (const PlacedCollider& each : placed) {
    const BodyPoints& points = points_.emplace_back(PointsOf(*each.collider));
    double reach = 0;
    for (const Vector3d& p : points.places_m) {
      reach = std::max(reach, (p - each.motion.pivot_m).norm());
    }
    reaches_m_.push_back(reach + points.radius_m);
  }
  size_t patch = 0;
  const auto add = [&](Face face, size_t most_contacts) {
    face.patch = patch;
    face.first = contacts_.size();
    faces_.push_back(face);
    contacts_.resize(contacts_.size() + most_contacts, {.face = faces_.size() - 1});
  };
  const auto add_points = [&](size_t solid, size_t other) {
    const size_t count = points_[solid].places_m.size();
    add({.solid = solid, .other = other, .spot_count = count}, count);
  };
  for (size_t a = 0; a < placed.size(); ++a) {
    for (size_t b = a + 1; b < placed.size(); ++b, ++patch) {
      if ((!placed[a].body && !placed[b].body) || joints_.AreTied(a, b)) continue;
      const auto convex_a = ConvexSolid::Of(*placed[a].collider);
      const auto convex_b = ConvexSolid::Of(*placed[b].collider);
      if (convex_a && convex_b) {
        const ConvexPair pair(*convex_a, *convex_b);
        add({.solid = a, .other = b, .pair = pair}, pair.most_spots());
        continue;
      }
      const bool is_a_ball = IsBall(*placed[a].collider), is_b_ball = IsBall(*placed[b].collider);
      if (is_a_ball || !is_b_ball) add_points(a, b);
      if (!is_a_ball) add_points(b, a);
    }
  }
}

void PatchContacts::Begin(const std::vector<PlacedCollider>& placed, double seconds) {
  seconds_ = seconds;
  joints_.Begin(placed, seconds);
  shifts_ = false;
  solved_.clear();
  for (Face& face : faces_) face.keeps_spots = false;
  for (Contact& contact : contacts_) {
    contact.touches = false;
    contact.impulse.setZero();
    contact.moment_on_solid.setZero();
    contact.moment_on_other.setZero();
  }
}

double PatchContacts::Solve(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers) {
  const auto is_as_solved = [&](size_t c) {
    return placed[c].end.velocity_m_per_s == solved_[c].velocity_m_per_s &&
           placed[c].end.angular_velocity_rad_per_s == solved_[c].angular_velocity_rad_per_s;
  };
  bool has_changed = solved_.empty();
  for (size_t c = 0; c < placed.size() && !has_changed; ++c) has_changed = !is_as_solved(c);
  if (!has_changed) return 0;
  std::vector<RigidMotion> before;
  for (const PlacedCollider& each : placed) before.push_back(each.end);
  const bool is_first = solved_.empty();
  const double kinetic = KineticEnergyOf(placed);
  if (!shifts_) {
    is_settled_ = Settle(placed, numbers);
    const bool is_too_fast = KineticEnergyOf(placed) > kMostEnergyOfJoints * kinetic;
    shifts_ = is_first && !joints_.joints().empty() && (!is_settled_ || is_too_fast);
    if (shifts_) DropImpulses(placed);
  }
  if (shifts_) SettlePlaces(placed);
  solved_.clear();
  for (const PlacedCollider& each : placed) solved_.push_back(each.end);
  return LargestChange(before);
}

bool PatchContacts::Settle(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers) {
  for (int round = 0; round < kMostRounds; ++round) {
    const bool is_off = Look(placed, When::kSubstep);
    // What others have pushed since may want less of what holds, or more friction.
    if (round > 0 && !is_off) return true;
    Resolve(placed, numbers, When::kSubstep);
  }
  return !Look(placed, When::kSubstep);
}

double PatchContacts::LargestChange(const std::vector<RigidMotion>& before) const {
  const auto change = [&](size_t c, const Vector3d& arm) -> Vector3d {
    return solved_[c].velocity_m_per_s - before[c].velocity_m_per_s +
           (solved_[c].angular_velocity_rad_per_s - before[c].angular_velocity_rad_per_s)
               .cross(arm);
  };
  double largest_change = 0;
  for (const Contact& contact : contacts_) {
    if (!contact.touches) continue;
    const Face& face = faces_[contact.face];
    const Vector3d relative =
        change(face.solid, contact.arm_of_solid) - change(face.other, contact.arm_of_other);
    largest_change = std::max(largest_change, relative.norm());
  }
  for (const BodyJoints::Joint& joint : joints_.joints()) {
    if (!joint.acts) continue;
    Vector3d across = Vector3d::Zero();
    for (const BodyJoints::End& end : joint.ends) {
      if (end.collider) across += end.push.transpose() * change(*end.collider, end.arm_m);
    }
    largest_change = std::max(largest_change, across.norm());
  }
  return largest_change;
}

void PatchContacts::Correct(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers) {
  Look(placed, When::kEnd);
  if (numbers.restitution > 0) FindRebounds(placed, numbers);
  Resolve(placed, numbers, When::kEnd);
  const std::vector<Momentum> sums = Sums();
  for (size_t c = 0; c < sums.size(); ++c) {
    given_[c].impulse_n_s += sums[c].linear;
    given_[c].angular_impulse_n_m_s += sums[c].angular;
  }
}

std::vector<Momentum> PatchContacts::Sums() const {
  std::vector<Momentum> sums(given_.size());
  for (const Contact& contact : contacts_) {
    const Face& face = faces_[contact.face];
    sums[face.solid].linear += contact.impulse;
    sums[face.solid].angular += contact.moment_on_solid;
    sums[face.other].linear -= contact.impulse;
    sums[face.other].angular += contact.moment_on_other;
  }
  joints_.AddTo(sums);
  return sums;
}

void PatchContacts::Resolve(std::vector<PlacedCollider>& placed, const BodyNumbers& numbers,
                            When when) {
  std::vector<double> speeds_along;
  if (when == When::kSubstep) {
    for (const Contact& contact : contacts_) {
      const double along = contact.touches ? VelocityOf(placed, contact).dot(contact.n) : 0;
      speeds_along.push_back(along);
    }
  }
  joints_.FindDemands(placed, when);
  // In the end what changes acts where the bodies are then; what has moved them keeps its moments,
  // so that of two bodies their angular momentum together stays. Not what is off: contacts that
  // contradict each other press with so much that the arms of the end would make it energy.
  if (when == When::kEnd && is_settled_) FindMoments();
  const std::vector<Momentum> pushed = Sums();
  for (size_t c = 0; c < placed.size(); ++c) {
    placed[c].Change(-pushed[c].linear, -pushed[c].angular);
  }
  for (size_t i = 0; i < contacts_.size(); ++i) {
    Contact& contact = contacts_[i];
    if (!contact.touches) {
      contact.impulse.setZero();
      contact.guesses.fill(Vector3d::Zero());
      contact.slides = false;
    } else if (when == When::kSubstep) {
      contact.least_m_per_s = speeds_along[i] - (contact.gap - contact.floor) / seconds_;
    }
  }
  for (const Island& island : Islands(placed)) {
    ResolveIsland(placed, island, pushed, numbers, when);
  }
  FindMoments();
  const std::vector<Momentum> sums = Sums();
  for (size_t c = 0; c < placed.size(); ++c) placed[c].Change(sums[c].linear, sums[c].angular);
}

void PatchContacts::FindMoments() {
  for (Contact& contact : contacts_) {
    contact.moment_on_solid = contact.arm_of_solid.cross(contact.impulse);
    contact.moment_on_other = -contact.arm_of_other.cross(contact.impulse);
  }
  joints_.FindMoments();
}

std::vector<PatchContacts::Island> PatchContacts::Islands(
    const std::vector<PlacedCollider>& placed) const {
  std::vector<size_t> island_of(placed.size());
  std::iota(island_of.begin(), island_of.end(), size_t{0});
  const auto tie = [&](size_t a, size_t b) {
    if (!placed[a].body || !placed[b].body) return;
    const size_t kept = island_of[a], gone = island_of[b];
    std::ranges::replace(island_of, gone, kept);
  };
  for (const Contact& contact : contacts_) {
    if (contact.touches) tie(faces_[contact.face].solid, faces_[contact.face].other);
  }
  const std::span<const BodyJoints::Joint> joints = joints_.joints();
  for (const BodyJoints::Joint& joint : joints) {
    if (joint.acts && joint.ends[1].collider) tie(*joint.ends[0].collider, *joint.ends[1].collider);
  }
  std::vector<Island> islands(placed.size());
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const Face& face = faces_[contacts_[i].face];
    const size_t body = placed[face.solid].body ? face.solid : face.other;
    if (contacts_[i].touches) islands[island_of[body]].contacts.push_back(i);
  }
  for (size_t j = 0; j < joints.size(); ++j) {
    if (joints[j].acts) islands[island_of[*joints[j].ends[0].collider]].joints.push_back(j);
  }
  std::erase_if(islands, [](const Island& island) {
    return island.contacts.empty() && island.joints.empty();
  });
  return islands;
}

ProblemSides PatchContacts::SidesOf(const Contact& contact, IslandBodies& bodies) const {
  const Face& face = faces_[contact.face];
  ProblemSides sides;
  bodies.AddSide(sides, face.solid, contact.arm_of_solid, Eigen::Matrix3d::Identity());
  bodies.AddSide(sides, face.other, contact.arm_of_other, -Eigen::Matrix3d::Identity());
  return sides;
}

// A hit adds no energy to what the bodies had when the substep began and what others have given
// them since: it is the plastic one and as much of the rebound as that allows (friction and
// rebounds together, and corners that turn within the substep, may ask for more).
void PatchContacts::ResolveIsland(const std::vector<PlacedCollider>& placed, const Island& island,
                                  const std::vector<Momentum>& pushed, const BodyNumbers& numbers,
                                  When when) {
  IslandBodies bodies(placed, when);
  std::vector<ProblemContact> contacts;
  std::vector<ProblemJoint> joints;
  bool rebounds = false;
  for (const size_t i : island.contacts) {
    const Contact& contact = contacts_[i];
    ProblemContact& its = contacts.emplace_back(SidesOf(contact, bodies));
    its.n = contact.n;
    its.free_m_per_s = VelocityOf(placed, contact);
    its.least_m_per_s = when == When::kEnd ? contact.rebound_m_per_s : contact.least_m_per_s;
    its.patch = faces_[contact.face].patch;
    its.impulse_n_s = contact.guesses[static_cast<size_t>(when)];
    its.slides = contact.slides;
    rebounds |= when == When::kEnd && contact.rebound_m_per_s > 0;
  }
  for (const size_t j : island.joints) {
    const BodyJoints::Joint& joint = joints_.joints()[j];
    ProblemSides sides = bodies.SidesOf(joint);
    sides.free_m_per_s = joints_.VelocityOf(placed, joint);
    sides.impulse_n_s = joint.guesses[static_cast<size_t>(when)];
    if (joint.described->is_rope()) {
      contacts.push_back({sides, Vector3d::UnitX(), joint.demanded_m_per_s.x(), false});
    } else {
      joints.push_back({sides, joint.demanded_m_per_s});
    }
  }
  ContactProblem problem(bodies.colliders().size());
  problem.contacts() = std::move(contacts);
  problem.joints() = std::move(joints);
  problem.SolveByPatches(numbers.friction_static, numbers.friction_dynamic);
  double share = 1;
  if (!rebounds && (island.joints.empty() || !problem.IsSolved())) {
    // What starts inside another one may be moved out.
    double allowed = kEnergyRounding * problem.change().squaredNorm();
    for (const size_t c : bodies.colliders()) {
      if (when == When::kEnd) break;
      allowed += placed[c].body->mass_kg() * std::pow(kMaxDepenetrationSpeed_m_per_s, 2);
    }
    problem.LimitEnergy(allowed);
  }
  std::optional<ContactProblem> plastic;  // only where some of it is needed
  if (rebounds) {
    double room = 0;  // for energy
    for (const size_t c : bodies.colliders()) {
      const RigidBody& body = *placed[c].body;
      // Impulses have lifted it.
      room += seconds_ * numbers.gravity_m_per_s2.dot(pushed[c].linear);
      const Vector3d& momentum = body.angular_momentum();
      room += body.SpinEnergyAt(placed[c].start.rotation, momentum) -
              body.SpinEnergyAt(placed[c].end.rotation, momentum);
    }
    const double size = problem.change().squaredNorm();
    if (problem.EnergyGiven() > room + kEnergyRounding * size) {
      plastic = problem;
      for (ProblemContact& contact : plastic->contacts()) contact.least_m_per_s = 0;
      plastic->SolveByPatches(numbers.friction_static, numbers.friction_dynamic);
      plastic->LimitEnergy(kEnergyRounding * plastic->change().squaredNorm());
      const Eigen::VectorXd more = problem.change() - plastic->change();
      const double a = more.squaredNorm() / 2;
      const double c = plastic->EnergyGiven() - room;
      share = LargestShare(a, problem.EnergyGiven() - room - a - c, c);
    }
  }
  // Of contact or joint k in `list` of both problems.
  const auto impulse_of = [&](size_t k, auto list) -> Vector3d {
    const Vector3d& impulse = list(problem)[k].impulse_n_s;
    if (!plastic) return impulse;
    return (1 - share) * list(*plastic)[k].impulse_n_s + share * impulse;
  };
  const auto contacts_of = [](const ContactProblem& its) { return std::span(its.contacts()); };
  const auto joints_of = [](const ContactProblem& its) { return std::span(its.joints()); };
  size_t k = 0, point_joint = 0;
  for (; k < island.contacts.size(); ++k) {
    Contact& contact = contacts_[island.contacts[k]];
    contact.impulse = contact.guesses[static_cast<size_t>(when)] = impulse_of(k, contacts_of);
    contact.slides = problem.contacts()[k].slides;
  }
  // Ropes come after the contacts.
  for (const size_t j : island.joints) {
    const bool is_rope = joints_.joints()[j].described->is_rope();
    const Vector3d impulse =
        is_rope ? impulse_of(k++, contacts_of) : impulse_of(point_joint++, joints_of);
    joints_.SetImpulse(j, impulse, when);
  }
}

Vector3d PatchContacts::VelocityOf(const std::vector<PlacedCollider>& placed,
                                   const Contact& contact) const {
  const Face& face = faces_[contact.face];
  return placed[face.solid].VelocityAt(contact.arm_of_solid) -
         placed[face.other].VelocityAt(contact.arm_of_other);
}

}  // namespace drape::bodies
