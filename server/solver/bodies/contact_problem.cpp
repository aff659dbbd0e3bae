#include "server/solver/bodies/contact_problem.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace drape::bodies {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Softness of a contact in one minimisation, relative to its mobility [-]. What it leaves is taken
// into the next one, so the result does not depend on it. Larger: more of them; smaller: the
// systems lose digits.
constexpr double kSoftness = 1e-6;
// Most minimisations; and the relative change of the motion below which they end [-]. The error
// left is smaller by kSoftness over the share that the least mobile motion has of a contact's
// mobility.
constexpr int kMostMinimisations = 80;
constexpr double kAgreement = 1e-9;
// Minimisations after which the lift of what slides follows by half: some go to and fro otherwise.
// Earlier: the others take longer; later: fewer are left.
constexpr int kFastMinimisations = 20;
// Most steps of one, and how often a step is halved [-]. Each step is exact while no contact opens,
// closes, sticks or slides.
constexpr int kMostSteps = 40;
constexpr int kMostHalvings = 40;
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

double SlidingOf(const ProblemContact& contact) {
  const Vector3d& v = contact.velocity_m_per_s;
  return (v - v.dot(contact.n) * contact.n).norm();
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
  return from_[i] - stiffness_[i] * over;
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
  return slope;
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
  const bool has_joints = !joints_.empty();
  const Eigen::Index size = has_joints ? free_.cols() : y_.size();
  MatrixXd hessian(size, size);
  VectorXd slope(y_.size());
  for (int step = 0; step < kMostSteps; ++step) {
    hessian.setIdentity();
    slope = y_;
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const ProblemContact& contact = contacts_[i];
      const Cone cone = Project(Wanted(i, y_), contact.n, contact.friction, true);
      if (cone.slope.isZero(0)) continue;  // open: no impulse either
      if (has_joints) {
        hessian += stiffness_[i] * along_free_[i].transpose() * cone.slope * along_free_[i];
      }
      for (size_t a = 0; a < contact.side_count; ++a) {
        const Mobility& of_a = contact.sides[a].mobility;
        const auto at_a = static_cast<Eigen::Index>(6 * contact.sides[a].body);
        slope.segment<6>(at_a) -= of_a.transpose() * cone.nearest;
        if (has_joints) continue;
        const Eigen::Matrix<double, 6, 3> weighed = stiffness_[i] * of_a.transpose() * cone.slope;
        for (size_t b = 0; b < contact.side_count; ++b) {
          const auto at_b = static_cast<Eigen::Index>(6 * contact.sides[b].body);
          hessian.block<6, 6>(at_a, at_b) += weighed * contact.sides[b].mobility;
        }
      }
    }
    if (has_joints) slope = free_.transpose() * slope;
    VectorXd way = -hessian.llt().solve(slope);
    const double descent = slope.dot(way);
    if (has_joints) way = free_ * way;
    if (way.norm() <= kAgreement / 10 * (y_.norm() + scale_)) {
      y_ += way;
      return;
    }
    // Convex: the slope along the way says where its lowest place is.
    double share = 1, low = 0, high = 1;
    for (int halving = 0; halving < kMostHalvings; ++halving) {
      const double at = SlopeAt(y_ + share * way).dot(way);
      if (std::abs(at) <= -descent / 2) break;
      if (at < 0 && share == 1) break;
      (at < 0 ? low : high) = share;
      share = (low + high) / 2;
    }
    y_ += share * way;
  }
}

// The method of multipliers, for the convex problem in which what slides also lifts by mu |c_t|;
// `shift_` takes that back (De Saxce and Feng 1998, «The bipotential method»).
void ContactProblem::Solve() {
  from_.resize(contacts_.size());
  shift_.resize(contacts_.size());
  stiffness_.resize(contacts_.size());
  FactorJoints();
  scale_ = OnJoints(VectorXd::Zero(static_cast<Eigen::Index>(6 * body_count_))).norm();
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ProblemContact& contact = contacts_[i];
    double mobility = 0;
    from_[i] = Project(contact.impulse_n_s, contact.n, contact.friction, false).nearest;
    for (size_t s = 0; s < contact.side_count; ++s) {
      mobility += contact.sides[s].mobility.squaredNorm() / 3;
    }
    stiffness_[i] = 1 / (kSoftness * mobility);
    const Vector3d over = contact.free_m_per_s - contact.least_m_per_s * contact.n;
    scale_ = std::max(scale_, over.norm() / std::sqrt(mobility));
  }
  y_ = OnJoints(ChangeByContacts());
  const auto update = [&](bool with_impulses, bool by_half) {
    for (size_t i = 0; i < contacts_.size(); ++i) {
      ProblemContact& contact = contacts_[i];
      if (with_impulses) {
        from_[i] = Project(Wanted(i, y_), contact.n, contact.friction, false).nearest;
      }
      contact.velocity_m_per_s = VelocityAt(contact, y_);
      const double lift = contact.friction * SlidingOf(contact);
      shift_[i] = by_half ? (shift_[i] + lift) / 2 : lift;
    }
  };
  update(false, false);
  VectorXd before;
  for (int round = 0; round < kMostMinimisations && !contacts_.empty(); ++round) {
    before = y_;
    Minimise();
    update(true, round >= kFastMinimisations);
    if ((y_ - before).norm() <= kAgreement * (y_.norm() + scale_)) break;
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
    stoppable += more_friction * normal * kMostOfMobility / (kSoftness * stiffness_[i]);
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
