#include "server/solver/bodies/contact_problem.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace drape::bodies {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Softness of a contact in one round of the method of multipliers, relative to its mobility [-]:
// at first; at last; and the rounds after which it becomes a tenth. What it leaves is taken into
// the next round, so the result does not depend on it. Larger: motions that the contacts barely
// hinder take more rounds; smaller: Newton's method finds its way with more steps, and systems lose
// digits.
constexpr double kFirstSoftness = 1e-3;
constexpr double kLastSoftness = 1e-6;
constexpr int kRoundsOfASoftness = 6;
// Most rounds; and how far from its conditions a contact may be in the end, as a share of the
// largest velocity [-].
constexpr int kMostRoundsOfImpulses = 80;
constexpr double kAgreement = 1e-9;
// Most steps of Newton's method in one round, and how often a step is halved [-]: for a minimum,
// and where there is none. Each step is exact while no contact opens, closes, sticks or slides.
constexpr int kMostSteps = 40;
constexpr int kMostHalvings = 40;
constexpr int kMostHalvingsOfLifts = 8;
// Of what a step promises, the share that it must keep [-].
constexpr double kKept = 1e-4;
// A contact slides where its velocity is more than this share of the largest one without impulses
// [-]. Smaller: what rounding leaves looks like sliding; larger: what slides slowly sticks.
constexpr double kSliding = 1e-6;
// Softness of joints in one solution of their equations, whose rows have the length 1, and how
// often these are solved for what is left [-]. It lets joints say a thing twice. Larger: chains of
// light bodies that carry heavy ones need more rounds; smaller: rounding decides.
constexpr double kJointSoftness = 1e-12;
constexpr int kJointRounds = 3;
// The largest mobility of a contact along a direction is at most this many times the mean [-].
constexpr double kMostOfMobility = 3;

struct Cone {
  Vector3d nearest;
  Matrix3d slope;
};

// The nearest point of the cone |t| <= mu n, and how it follows z.
Cone Project(const Vector3d& z, const Vector3d& n, double friction, bool with_slope) {
  const double along = z.dot(n);
  const Vector3d across = z - along * n;
  const double size = across.norm();
  Cone cone{Vector3d::Zero(), Matrix3d::Zero()};
  if (friction * size <= -along) return cone;
  if (size <= friction * along) {
    cone.nearest = z;
    if (with_slope) cone.slope.setIdentity();
    return cone;
  }
  const Vector3d t = across / size;
  const double share = 1 / (1 + friction * friction);
  const Vector3d edge = n + friction * t;
  const double normal = share * (along + friction * size);
  cone.nearest = normal * edge;
  if (with_slope) {
    cone.slope = share * edge * edge.transpose();
    const Matrix3d beside = Matrix3d::Identity() - n * n.transpose() - t * t.transpose();
    cone.slope += friction * normal / size * beside;
  }
  return cone;
}

Vector3d SlidingOf(const Vector3d& velocity, const Vector3d& n) {
  return velocity - velocity.dot(n) * n;
}

double SlidingOf(const ProblemContact& contact) {
  return SlidingOf(contact.velocity_m_per_s, contact.n).norm();
}

}  // namespace

Mobility MobilityOf(double mass_kg, const Matrix3d& root, const Vector3d& arm_m) {
  Matrix3d cross;
  cross << 0, -arm_m.z(), arm_m.y(), arm_m.z(), 0, -arm_m.x(), -arm_m.y(), arm_m.x(), 0;
  Mobility mobility;
  mobility << Matrix3d::Identity() / std::sqrt(mass_kg), -cross * root;
  return mobility;
}

Vector3d ContactProblem::VelocityAt(const ProblemSides& its, const VectorXd& y) const {
  Vector3d velocity = its.free_m_per_s;
  for (size_t s = 0; s < its.side_count; ++s) {
    const auto& [body, mobility] = its.sides[s];
    const auto index = static_cast<Eigen::Index>(6 * body);
    velocity += mobility * y.segment<6>(index);
  }
  return velocity;
}

Vector3d ContactProblem::Wanted(size_t i, const VectorXd& y) const {
  const ProblemContact& contact = contacts_[i];
  const Vector3d over = VelocityAt(contact, y) + (shift_[i] - contact.least_m_per_s) * contact.n;
  return from_[i] - Stiffness(i) * over;
}

VectorXd ContactProblem::SlopeAt(const VectorXd& y) const {
  VectorXd slope = y;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    const Vector3d impulse = Project(Wanted(i, y), contact.n, contact.friction, false).nearest;
    for (size_t s = 0; s < contact.side_count; ++s) {
      const auto& [body, mobility] = contact.sides[s];
      slope.segment<6>(static_cast<Eigen::Index>(6 * body)) -= mobility.transpose() * impulse;
    }
  }
  return joints_.empty() ? slope : free_.transpose() * slope;
}

MatrixXd ContactProblem::DerivativeAt(const VectorXd& y, bool lifts_follow) const {
  const bool has_joints = !joints_.empty();
  const Eigen::Index size = has_joints ? free_.cols() : y.size();
  MatrixXd derivative = MatrixXd::Identity(size, size);
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    const Cone cone = Project(Wanted(i, y), contact.n, contact.friction, true);
    if (cone.slope.isZero(0)) continue;  // open
    Matrix3d weight = Stiffness(i) * cone.slope;
    if (lifts_follow && shift_[i] > 0) {
      const Vector3d sliding = SlidingOf(VelocityAt(contact, y), contact.n);
      const Vector3d lift = contact.friction * sliding.normalized();
      weight += weight * contact.n * lift.transpose();
    }
    if (has_joints) {
      derivative += along_free_[i].transpose() * weight * along_free_[i];
      continue;
    }
    for (size_t a = 0; a < contact.side_count; ++a) {
      const auto at_a = static_cast<Eigen::Index>(6 * contact.sides[a].body);
      const Eigen::Matrix<double, 6, 3> of_a = contact.sides[a].mobility.transpose() * weight;
      for (size_t b = 0; b < contact.side_count; ++b) {
        const auto at_b = static_cast<Eigen::Index>(6 * contact.sides[b].body);
        derivative.block<6, 6>(at_a, at_b) += of_a * contact.sides[b].mobility;
      }
    }
  }
  return derivative;
}

bool ContactProblem::IsSmall(const VectorXd& way) const {
  return way.norm() <= kAgreement / 10 * (y_.norm() + scale_);
}

// Joints demand A y = d. From any y, the least change that does it is Aᵀ λ with A Aᵀ λ = d - A y.
void ContactProblem::FactorJoints() {
  if (joints_.empty() || rows_.size() > 0) return;
  const auto count = static_cast<Eigen::Index>(3 * joints_.size());
  const auto size = static_cast<Eigen::Index>(6 * body_count_);
  rows_.setZero(count, size);
  demanded_.resize(count);
  for (size_t j = 0; j < joints_.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(3 * j);
    for (size_t s = 0; s < joints_[j].side_count; ++s) {
      const auto& [body, mobility] = joints_[j].sides[s];
      rows_.block<3, 6>(at, static_cast<Eigen::Index>(6 * body)) += mobility;
    }
    demanded_.segment<3>(at) = joints_[j].demanded_m_per_s - joints_[j].free_m_per_s;
  }
  row_scales_ = rows_.rowwise().norm().cwiseInverse();
  rows_.array().colwise() *= row_scales_.array();
  demanded_.array() *= row_scales_.array();
  MatrixXd gram = rows_ * rows_.transpose();
  gram.diagonal().array() += kJointSoftness;
  gram_.compute(gram);
  if (contacts_.empty()) return;
  // An orthogonal projection, whose trace is its rank.
  const MatrixXd left = MatrixXd::Identity(size, size) - rows_.transpose() * gram_.solve(rows_);
  const auto rank = static_cast<Eigen::Index>(std::lround(left.trace()));
  free_.setIdentity(size, rank);
  free_.applyOnTheLeft(left.colPivHouseholderQr().householderQ());
  along_free_.clear();
  for (const ProblemContact& contact : contacts_) {
    Eigen::Matrix<double, 3, Eigen::Dynamic>& along = along_free_.emplace_back();
    along.setZero(3, rank);
    for (size_t s = 0; s < contact.side_count; ++s) {
      const auto at = static_cast<Eigen::Index>(6 * contact.sides[s].body);
      along += contact.sides[s].mobility * free_.middleRows<6>(at);
    }
  }
}

VectorXd ContactProblem::JointImpulses(const VectorXd& by_contacts) const {
  VectorXd impulses = VectorXd::Zero(rows_.rows());
  for (int round = 0; round < kJointRounds; ++round) {
    const VectorXd y = by_contacts + rows_.transpose() * impulses;
    impulses += gram_.solve(demanded_ - rows_ * y);
  }
  return impulses;
}

VectorXd ContactProblem::OnJoints(const VectorXd& by_contacts) const {
  if (joints_.empty()) return by_contacts;
  return by_contacts + rows_.transpose() * JointImpulses(by_contacts);
}

VectorXd ContactProblem::ChangeByContacts() const {
  VectorXd y = VectorXd::Zero(static_cast<Eigen::Index>(6 * body_count_));
  for (size_t i = 0; i < contacts_.size(); ++i) {
    for (size_t s = 0; s < contacts_[i].side_count; ++s) {
      const auto& [body, mobility] = contacts_[i].sides[s];
      y.segment<6>(static_cast<Eigen::Index>(6 * body)) += mobility.transpose() * from_[i];
    }
  }
  return y;
}

// Newton's method: the function is convex and smooth but for the second derivative. With joints it
// moves along what they leave, in as many numbers as that has dimensions.
void ContactProblem::Minimise() {
  for (int step = 0; step < kMostSteps; ++step) {
    const VectorXd slope = SlopeAt(y_);
    const VectorXd way = -DerivativeAt(y_, false).llt().solve(slope);
    const double descent = slope.dot(way);
    const VectorXd moves = joints_.empty() ? way : free_ * way;
    if (IsSmall(way)) {
      y_ += moves;
      return;
    }
    // Convex: the slope along the way says where its lowest place is.
    double share = 1, low = 0, high = 1;
    for (int halving = 0; halving < kMostHalvings; ++halving) {
      const double at = SlopeAt(y_ + share * moves).dot(way);
      if (std::abs(at) <= -descent / 2) break;
      if (at < 0 && share == 1) break;
      (at < 0 ? low : high) = share;
      share = (low + high) / 2;
    }
    y_ += share * moves;
  }
}

void ContactProblem::LiftAt(const VectorXd& y) {
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    shift_[i] = 0;
    const Vector3d wanted = Wanted(i, y);
    const double along = wanted.dot(contact.n);
    if (SlidingOf(wanted, contact.n).norm() <= contact.friction * along) continue;  // sticks
    shift_[i] = contact.friction * SlidingOf(VelocityAt(contact, y), contact.n).norm();
  }
}

bool ContactProblem::MoveWithLifts() {
  const VectorXd start = y_;
  LiftAt(y_);
  VectorXd slope = SlopeAt(y_);
  for (int step = 0; step < kMostSteps; ++step) {
    VectorXd way = -DerivativeAt(y_, true).partialPivLu().solve(slope);
    if (!way.allFinite()) break;
    if (!joints_.empty()) way = free_ * way;
    if (IsSmall(way)) {
      y_ += way;
      LiftAt(y_);
      return true;
    }
    double share = 1;
    for (int halving = 0;; ++halving) {
      const VectorXd there = y_ + share * way;
      LiftAt(there);
      const VectorXd slope_there = SlopeAt(there);
      if (slope_there.norm() < (1 - kKept * share) * slope.norm()) {
        y_ = there;
        slope = slope_there;
        break;
      }
      if (halving == kMostHalvingsOfLifts) {
        y_ = start;
        return false;
      }
      share /= 2;
    }
  }
  y_ = start;
  return false;
}

double ContactProblem::TakeImpulses() {
  double off = 0;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    const Vector3d next = Project(Wanted(i, y_), contact.n, contact.friction, false).nearest;
    off = std::max(off, (next - from_[i]).norm() / Stiffness(i));
    from_[i] = next;
  }
  return off;
}

double ContactProblem::TakeLifts() {
  double off = 0;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    const double lift = contact.friction * SlidingOf(VelocityAt(contact, y_), contact.n).norm();
    off = std::max(off, std::abs(lift - shift_[i]));
    shift_[i] = lift;
  }
  return off;
}

// The method of multipliers, for the convex problem in which what slides also lifts by mu |c_t|;
// `shift_` takes that back (De Saxce and Feng 1998, «The bipotential method»). The lifts follow the
// motion from round to round, or, which takes fewer rounds, within one.
void ContactProblem::Solve() {
  const size_t count = contacts_.size();
  from_.resize(count);
  shift_.assign(count, 0);
  mobility_.assign(count, 0);
  softness_ = kFirstSoftness;
  FactorJoints();
  y_ = OnJoints(VectorXd::Zero(static_cast<Eigen::Index>(6 * body_count_)));
  scale_ = y_.norm();
  double fastest = 0;
  for (size_t i = 0; i < count; ++i) {
    const ProblemContact& contact = contacts_[i];
    from_[i] = Project(contact.impulse_n_s, contact.n, contact.friction, false).nearest;
    for (size_t s = 0; s < contact.side_count; ++s) {
      mobility_[i] += contact.sides[s].mobility.squaredNorm() / 3;
    }
    const Vector3d demanded = contact.least_m_per_s * contact.n;
    const double over = (contact.free_m_per_s - demanded).norm();
    scale_ = std::max(scale_, over / std::sqrt(mobility_[i]));
    fastest = std::max({fastest, over, (VelocityAt(contact, y_) - demanded).norm()});
  }
  y_ = OnJoints(ChangeByContacts());
  TakeLifts();
  for (int round = 0; round < kMostRoundsOfImpulses && count > 0; ++round) {
    if (round > 0 && round % kRoundsOfASoftness == 0 && softness_ > kLastSoftness) softness_ /= 10;
    if (round == 0 || !MoveWithLifts()) {
      TakeLifts();
      Minimise();
    }
    const double off = TakeImpulses();
    if (off + TakeLifts() <= kAgreement * fastest) break;
  }
  // The motion is that of the impulses, also where the rounds did not end.
  const VectorXd by_contacts = ChangeByContacts();
  y_ = by_contacts;
  if (!joints_.empty()) {
    const VectorXd by_joints = JointImpulses(by_contacts);
    y_ += rows_.transpose() * by_joints;
    for (size_t j = 0; j < joints_.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(3 * j);
      joints_[j].impulse_n_s = by_joints.segment<3>(at).cwiseProduct(row_scales_.segment<3>(at));
    }
  }
  for (size_t i = 0; i < contacts_.size(); ++i) {
    contacts_[i].impulse_n_s = from_[i];
    contacts_[i].velocity_m_per_s = VelocityAt(contacts_[i], y_);
  }
}

// With the dynamic coefficient a patch is faster than static friction could stop it.
bool ContactProblem::IsFast(size_t patch, double more_friction) const {
  double fastest = 0, stoppable = 0;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    if (!contact.has_friction || contact.patch != patch) continue;
    const double normal = contact.impulse_n_s.dot(contact.n);
    if (normal > 0) fastest = std::max(fastest, SlidingOf(contact));
    stoppable += more_friction * normal * kMostOfMobility * mobility_[i];
  }
  return fastest > stoppable;
}

void ContactProblem::SolveByPatches(double friction_static, double friction_dynamic) {
  double fastest = 0;
  for (ProblemContact& contact : contacts_) {
    contact.friction = contact.slides ? friction_dynamic : friction_static;
    if (!contact.has_friction) contact.friction = 0;
    const Vector3d over = contact.free_m_per_s - contact.least_m_per_s * contact.n;
    fastest = std::max(fastest, over.norm());
  }
  const auto set = [&](bool slides, const std::vector<size_t>& patches) {
    for (ProblemContact& contact : contacts_) {
      if (!contact.has_friction || std::ranges::find(patches, contact.patch) == patches.end()) {
        continue;
      }
      contact.slides = slides;
      contact.friction = slides ? friction_dynamic : friction_static;
    }
  };
  Solve();
  if (friction_dynamic == friction_static) return;
  const auto slides_now = [&](const ProblemContact& contact) {
    return contact.has_friction && contact.impulse_n_s.dot(contact.n) > 0 &&
           SlidingOf(contact) > kSliding * fastest;
  };
  // Those that slid before and are slow may stick now.
  std::vector<size_t> slow;
  for (const ProblemContact& contact : contacts_) {
    if (!contact.slides || IsFast(contact.patch, friction_static - friction_dynamic)) continue;
    slow.push_back(contact.patch);
  }
  set(false, slow);
  if (!slow.empty()) Solve();
  for (;;) {
    std::vector<size_t> sliding;
    for (const ProblemContact& contact : contacts_) {
      if (!contact.slides && slides_now(contact)) sliding.push_back(contact.patch);
    }
    if (sliding.empty()) return;
    set(true, sliding);
    Solve();
  }
}

double ContactProblem::EnergyGiven() const {
  double energy = y_.squaredNorm() / 2;
  for (const ProblemContact& contact : contacts_) {
    energy += contact.impulse_n_s.dot(contact.free_m_per_s);
  }
  for (const ProblemJoint& joint : joints_) energy += joint.impulse_n_s.dot(joint.free_m_per_s);
  return energy;
}

bool ContactProblem::IsSolved() const {
  double fastest = 0, largest_error = 0;
  for (const ProblemJoint& joint : joints_) {
    const Vector3d& demanded = joint.demanded_m_per_s;
    fastest = std::max(fastest, (joint.free_m_per_s - demanded).norm());
    largest_error = std::max(largest_error, (VelocityAt(joint, y_) - demanded).norm());
  }
  for (const ProblemContact& contact : contacts_) {
    const Vector3d demanded = contact.least_m_per_s * contact.n;
    fastest = std::max(fastest, (contact.free_m_per_s - demanded).norm());
    const double along = contact.velocity_m_per_s.dot(contact.n);
    largest_error = std::max(largest_error, contact.least_m_per_s - along);
  }
  return largest_error <= kSliding * fastest;
}

void ContactProblem::LimitEnergy(double allowed) {
  const double energy = EnergyGiven(), square = y_.squaredNorm();
  if (!(energy > allowed) || square == 0) return;
  const double share = std::clamp((square / 2 - energy) / square, 0.0, 1.0);
  y_ *= share;
  for (ProblemContact& contact : contacts_) {
    contact.impulse_n_s *= share;
    contact.velocity_m_per_s = VelocityAt(contact, y_);
  }
  for (ProblemJoint& joint : joints_) joint.impulse_n_s *= share;
}

}  // namespace drape::bodies
