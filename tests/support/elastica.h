// A heavy strip held by one end: the chain of stiff joints that a cloth of a given resolution is,
// and the elastica (Bernoulli, Euler) that it becomes. Shares nothing with the product.
#pragma once

#include <vector>

namespace drape::test {

// Links of one length, between lines of particles 0, 1, 2, ...; lines 0 and 1 are held, so that the
// first link is horizontal.
struct StiffChain {
  double link_m = 0;
  std::vector<double> masses_kg;        // [line_count]
  std::vector<double> stiffnesses_n_m;  // [line_count] moment over the sine of the angle at a line
};

// The angle of each link below the horizontal in equilibrium: at every line k from 1 on the moment
// of the weights beyond it is stiffness_k * sin(angle_k - angle_(k-1)). [line_count - 1]; Newton's
// method, to rounding.
std::vector<double> HangingAngles(const StiffChain& chain, double gravity_m_per_s2);

// Smallest angular frequency of small vibrations across the chain [1/s], without gravity, and the
// displacements of its lines in that mode, 1 at the end. [line_count]
struct Vibration {
  double frequency_per_s = 0;
  std::vector<double> shape;
};
Vibration SlowestVibration(const StiffChain& chain);

// The elastica B a'' = -q (L - s) cos a, a(0) = a'(L) = 0: how far its end is below its beginning
// [m]. q is the weight per length and B the rigidity, both of the same width. Runge-Kutta of fourth
// order, steps halved until the result stands still to 1e-10 L.
double ElasticaDrop_m(double length_m, double rigidity_n_m2, double weight_n_per_m);

}  // namespace drape::test
