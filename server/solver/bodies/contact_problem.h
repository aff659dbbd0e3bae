// Impulses of all contacts between some bodies at once (server/solver/method.md, "Bodies"). Pure.
#pragma once

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

struct ProblemContact {
  struct Side {
    size_t body = 0;
    Mobility mobility;  // reversed of what feels the impulse reversed
  };

  std::array<Side, 2> sides;     // [side_count]
  size_t side_count = 0;         // 1: on something that no impulse moves
  Eigen::Vector3d n;             // unit
  Eigen::Vector3d free_m_per_s;  // relative velocity without any of the impulses
  double least_m_per_s = 0;      // along n, afterwards
  double friction = 0;
  size_t patch = 0;     // contacts of one patch stick or slide together
  bool slides = false;  // in: a guess
  Eigen::Vector3d impulse_n_s = Eigen::Vector3d::Zero();  // in: a guess

  // After a solution.
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
};

// Finds impulses P inside the cones of friction and velocities c = free + K P with
//   c_n >= least,  P_n >= 0,  one of both an equality,
//   c_t = 0 where |P_t| < mu P_n, and P_t = -mu P_n c_t/|c_t| otherwise.
// Where many impulses do the same, those nearest to the guess; so what is symmetric stays so.
class ContactProblem {
 public:
  explicit ContactProblem(size_t body_count) : body_count_(body_count) {}

  std::vector<ProblemContact>& contacts() { return contacts_; }
  const std::vector<ProblemContact>& contacts() const { return contacts_; }

  void Solve();
  // With the static coefficient; patches that then slide, with the dynamic one.
  void SolveByPatches(double friction_static, double friction_dynamic);
  // What the impulses of a solution add to the kinetic energy, seen from what no impulse moves [J].
  double EnergyGiven() const;
  // Scales the impulses down to those that give least where they give more than `allowed` [J]:
  // where contacts contradict each other no impulses solve the problem, and those found may be
  // large.
  void LimitEnergy(double allowed);
  const Eigen::VectorXd& change() const { return y_; }  // of scaled momenta, by the impulses

 private:
  bool IsFast(size_t patch, double more_friction) const;
  // Of the contacts with the shifts `shift_`, from multipliers `from_`: minimises in y.
  void Minimise();
  Eigen::VectorXd SlopeAt(const Eigen::VectorXd& y) const;
  Eigen::Vector3d VelocityAt(const ProblemContact& contact, const Eigen::VectorXd& y) const;
  // The multiplier of contact i before its projection.
  Eigen::Vector3d Wanted(size_t i, const Eigen::VectorXd& y) const;

  size_t body_count_;
  std::vector<ProblemContact> contacts_;
  std::vector<Eigen::Vector3d> from_;  // [contact_count] impulses
  std::vector<double> shift_;          // [contact_count] along n [m/s]
  std::vector<double> stiffness_;      // [contact_count] [kg]
  Eigen::VectorXd y_;                  // [6 body_count]
  double scale_ = 0;                   // of y
};

}  // namespace drape::bodies
