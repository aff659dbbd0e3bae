// Impulses of all contacts between some bodies at once (server/solver/method.md, "Bodies"). Pure.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace drape::bodies {

// Velocities that impulses change, one column of three rows per axis: of the body's momenta, scaled
// so that half the square of y is the energy.
using Mobility = Eigen::Matrix<double, 3, 6>;

// The velocity of a place `arm_m` from the centre per unit of the scaled momenta y; `root` times
// its transpose is the inverse inertia.
Mobility MobilityOf(double mass_kg, const Eigen::Matrix3d& root, const Eigen::Vector3d& arm_m);

// What acts between two bodies, or on one.
struct ProblemSides {
  struct Side {
    size_t body = 0;
    Mobility mobility;  // reversed of what feels the impulse reversed
  };

  std::array<Side, 2> sides{};   // [side_count]
  size_t side_count = 0;         // 1: on something that no impulse moves
  Eigen::Vector3d free_m_per_s;  // relative velocity without any of the impulses
  Eigen::Vector3d impulse_n_s = Eigen::Vector3d::Zero();  // in, of contacts: a guess
};

struct ProblemContact : ProblemSides {
  Eigen::Vector3d n;         // unit
  double least_m_per_s = 0;  // along n, afterwards
  bool has_friction = true;
  double friction = 0;
  size_t patch = 0;     // contacts of one patch stick or slide together
  bool slides = false;  // in: a guess

  // After a solution.
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
};

// Its impulse makes the velocity what is demanded.
struct ProblemJoint : ProblemSides {
  Eigen::Vector3d demanded_m_per_s = Eigen::Vector3d::Zero();
};

// Finds impulses P inside the cones of friction and velocities c = free + K P with
//   c_n >= least,  P_n >= 0,  one of both an equality,
//   c_t = 0 where |P_t| < mu P_n, and P_t = -mu P_n c_t/|c_t| otherwise.
// and of joints any impulses, with c = demanded. Where many impulses of contacts do the same, those
// nearest to the guess, of joints the smallest; so what is symmetric stays so, and joints may say a
// thing twice.
class ContactProblem {
 public:
  explicit ContactProblem(size_t body_count) : body_count_(body_count) {}

  std::vector<ProblemContact>& contacts() { return contacts_; }
  const std::vector<ProblemContact>& contacts() const { return contacts_; }
  // Complete before the first solution.
  std::vector<ProblemJoint>& joints() { return joints_; }
  const std::vector<ProblemJoint>& joints() const { return joints_; }

  void Solve();
  // Contacts with the static coefficient; patches that then slide, with the dynamic one.
  void SolveByPatches(double friction_static, double friction_dynamic);
  // What the impulses of a solution add to the kinetic energy, seen from what no impulse moves [J].
  double EnergyGiven() const;
  // Whether the last solution does what contacts and joints demand; else they contradict each
  // other.
  bool IsSolved() const;
  // Scales the impulses down to those that give least where they give more than `allowed` [J]:
  // where contacts contradict each other no impulses solve the problem, and those found may be
  // large.
  void LimitEnergy(double allowed);
  const Eigen::VectorXd& change() const { return y_; }  // of scaled momenta, by the impulses

 private:
  void FactorJoints();
  // Those, scaled as the rows are, that give joints what they demand if contacts change y so.
  Eigen::VectorXd JointImpulses(const Eigen::VectorXd& by_contacts) const;
  // `by_contacts` and what joints add.
  Eigen::VectorXd OnJoints(const Eigen::VectorXd& by_contacts) const;
  bool IsFast(size_t patch, double more_friction) const;
  // Of the contacts with the shifts `shift_`, from multipliers `from_`: minimises in y.
  void Minimise();
  // Newton's method for what slides and lifts by it at once: no minimum, its derivative is not
  // symmetric. Returns whether it got there; if not, y_ is what it was, and shifts are of no use.
  bool MoveWithLifts();
  // Shifts by what slides with y; what sticks lifts by nothing.
  void LiftAt(const Eigen::VectorXd& y);
  // Multipliers, shifts that y_ asks for. Returns the largest change, as a velocity [m/s].
  double TakeImpulses();
  double TakeLifts();
  // Of the function that Minimise() makes least, along what joints leave; and the derivative of
  // that, with shifts that stay or that follow y.
  Eigen::VectorXd SlopeAt(const Eigen::VectorXd& y) const;
  Eigen::MatrixXd DerivativeAt(const Eigen::VectorXd& y, bool lifts_follow) const;
  bool IsSmall(const Eigen::VectorXd& way) const;
  double Stiffness(size_t i) const { return 1 / (softness_ * mobility_[i]); }  // [kg]
  Eigen::Vector3d VelocityAt(const ProblemSides& its, const Eigen::VectorXd& y) const;
  // The change of y by the impulses `from_` of the contacts.
  Eigen::VectorXd ChangeByContacts() const;
  // The multiplier of contact i before its projection.
  Eigen::Vector3d Wanted(size_t i, const Eigen::VectorXd& y) const;

  size_t body_count_;
  std::vector<ProblemContact> contacts_;
  std::vector<Eigen::Vector3d> from_;  // [contact_count] impulses
  std::vector<double> shift_;          // [contact_count] along n [m/s]
  std::vector<double> mobility_;       // [contact_count] [1/kg]
  double softness_ = 0;                // relative to it
  Eigen::VectorXd y_;                  // [6 body_count]
  double scale_ = 0;                   // of y

  std::vector<ProblemJoint> joints_;
  // Of them, [3 joint_count] rows: their mobilities, to length 1 by row_scales_; what they demand.
  Eigen::MatrixXd rows_;
  Eigen::VectorXd row_scales_;  // [kg^(1/2)]
  Eigen::VectorXd demanded_;
  Eigen::LLT<Eigen::MatrixXd> gram_;
  // What joints leave: orthonormal columns, [6 body_count, dimensions]; and the mobilities of the
  // contacts along them, [contact_count].
  Eigen::MatrixXd free_;
  std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> along_free_;
};

}  // namespace drape::bodies
