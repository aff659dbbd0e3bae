// Reading states of any backend, and comparing them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "server/scene/particle_state.h"
#include "server/solver/backend.h"

namespace drape::test {

// Positions and velocities of one cloth in its own frame; exact for float and double backends.
ParticleState ReadState(Backend& backend, ClothHandle cloth);

// The bytes of positions and velocities: equal if and only if the states are bit for bit equal.
std::string ReadBits(Backend& backend, ClothHandle cloth);

// Each component rounded to single precision. Not v.cast<float>().cast<double>(): GCC 12 drops that
// pair of conversions when it vectorises (-O2).
Eigen::Vector3d RoundToFloat(const Eigen::Vector3d& v);
void RoundToFloat(std::vector<Eigen::Vector3d>& vectors);

bool IsFinite(const ParticleState& state);

// Unit round-off of a backend's numbers: 2^-24 or 2^-53. A rounded operation is off by at most this
// share of its result.
double UnitRoundOff(const Backend& backend);

// Distance from |magnitude| to the next larger number of the scalar type.
double Ulp(ScalarType scalar, double magnitude);

// |actual - expected| in ulps of the larger of the two.
double UlpsBetween(ScalarType scalar, double actual, double expected);

// The largest difference of two lists of vectors.
struct WorstOffender {
  size_t particle = 0;
  double distance = 0;  // infinite if a value is not finite or the lengths differ
  std::string message;  // particle, value and reference in full precision
};
WorstOffender FindWorst(const std::vector<Eigen::Vector3d>& actual,
                        const std::vector<Eigen::Vector3d>& expected);

}  // namespace drape::test
