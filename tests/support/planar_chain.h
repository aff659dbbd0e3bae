// The exact motion of a planar chain: N rigid links below a fixed pivot, a point mass at the end of
// each. In minimal coordinates (one angle per link) nothing can stretch and nothing is projected,
// so it shares neither method nor error with what it judges. N = 1 is the pendulum, N = 2 the
// double pendulum, and every column of a cloth hung by its whole top row is such a chain
// (`CurtainColumn`).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace drape::test {

class PlanarChain {
 public:
  struct Link {
    double length_m = 1;    // > 0
    double mass_kg = 1;     // > 0, at its lower end
    double angle_rad = 0;   // from straight down, towards +x
    double rate_rad_s = 0;  // angular velocity
  };

  // From the pivot downwards, at least one.
  explicit PlanarChain(std::vector<Link> links, double gravity_m_per_s2 = 9.81);

  // By the classical Runge-Kutta method of fourth order, `steps` equal steps.
  void Advance(double duration_s, uint32_t steps);
  // In twice as many steps until no particle moves by more than 15 tolerance_m, which is an error
  // of about tolerance_m for a method of fourth order. Returns that last change / 15 [m]; ends the
  // process if it is not there after 2^24 steps (the motion is chaotic by then, or the tolerance
  // below round-off).
  double AdvanceConverged(double duration_s, double tolerance_m);

  // [link_count + 1], the pivot (the origin) first; in the xy plane, +y up.
  std::vector<Eigen::Vector3d> Positions_m() const;
  std::vector<Eigen::Vector3d> Velocities_m_per_s() const;
  // Tension of each link, from the pivot downwards; > 0 pulls.
  std::vector<double> Tensions_n() const;
  // Kinetic and potential, 0 for the pivot's height and no motion.
  double Energy_j() const;
  const std::vector<Link>& links() const { return links_; }

 private:
  std::vector<Link> links_;
  double gravity_;  // [m/s^2]
};

// `link_count` equal links of link_m in a straight line.
PlanarChain StraightChain(uint32_t link_count, double link_m, double mass_kg, double angle_rad);

// The same, at rest in the small mode of the zero z of the Laguerre polynomial L_n
// (closed_forms.h), scaled so that its steepest link is at the angle.
PlanarChain ChainInMode(uint32_t link_count, double link_m, double mass_kg, double z,
                        double steepest_rad);

// One column of a grid of `rows` rows and height_m hung by its whole first row, let go
// horizontally: x of the chain is z of the grid. All columns stay equal and their mass cancels.
PlanarChain CurtainColumn(uint32_t rows, double height_m);

}  // namespace drape::test
