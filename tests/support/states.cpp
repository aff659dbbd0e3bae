#include "tests/support/states.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iomanip>
#include <limits>
#include <sstream>

namespace drape::test {
namespace {

using Eigen::Vector3d;

StateColumns ReadBoth(Backend& backend, ClothHandle cloth) {
  return backend.Read({{&cloth, 1}, true, true});
}

std::vector<Vector3d> ToVectors(const ScalarColumn& column) {
  return std::visit(
      [](const auto& values) {
        std::vector<Vector3d> vectors;
        for (size_t k = 0; k + 2 < values.size(); k += 3) {
          vectors.emplace_back(values[k], values[k + 1], values[k + 2]);
        }
        return vectors;
      },
      column);
}

std::string ToBytes(const ScalarColumn& column) {
  return std::visit(
      [](const auto& values) {
        return std::string(reinterpret_cast<const char*>(values.data()),
                           values.size() * sizeof(values[0]));
      },
      column);
}

bool AreFinite(const std::vector<Vector3d>& vectors) {
  return std::all_of(vectors.begin(), vectors.end(),
                     [](const Vector3d& v) { return v.allFinite(); });
}

}  // namespace

ParticleState ReadState(Backend& backend, ClothHandle cloth) {
  const StateColumns columns = ReadBoth(backend, cloth);
  return {ToVectors(columns.positions_m), ToVectors(columns.velocities_m_per_s)};
}

std::string ReadBits(Backend& backend, ClothHandle cloth) {
  const StateColumns columns = ReadBoth(backend, cloth);
  return ToBytes(columns.positions_m) + ToBytes(columns.velocities_m_per_s);
}

Vector3d RoundToFloat(const Vector3d& v) {
  Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    volatile float rounded = static_cast<float>(v[axis]);
    result[axis] = rounded;
  }
  return result;
}

void RoundToFloat(std::vector<Vector3d>& vectors) {
  for (Vector3d& v : vectors) v = RoundToFloat(v);
}

bool IsFinite(const ParticleState& state) {
  return AreFinite(state.positions_m) && AreFinite(state.velocities_m_per_s);
}

double UnitRoundOff(const Backend& backend) {
  const bool is_float = backend.Describe().scalar == ScalarType::kFloat32;
  return is_float ? 0x1p-24 : 0x1p-53;
}

double Ulp(ScalarType scalar, double magnitude) {
  const double size = std::fabs(magnitude);
  if (scalar == ScalarType::kFloat64) {
    return std::nextafter(size, std::numeric_limits<double>::infinity()) - size;
  }
  const float rounded = static_cast<float>(size);
  return double{std::nextafter(rounded, std::numeric_limits<float>::infinity())} - double{rounded};
}

double UlpsBetween(ScalarType scalar, double actual, double expected) {
  const double magnitude = std::max(std::fabs(actual), std::fabs(expected));
  return std::fabs(actual - expected) / Ulp(scalar, magnitude);
}

WorstOffender FindWorst(const std::vector<Vector3d>& actual,
                        const std::vector<Vector3d>& expected) {
  WorstOffender worst;
  if (actual.size() != expected.size()) {
    worst.distance = std::numeric_limits<double>::infinity();
    worst.message =
        std::to_string(actual.size()) + " particles instead of " + std::to_string(expected.size());
    return worst;
  }
  for (size_t i = 0; i < actual.size(); ++i) {
    double distance = (actual[i] - expected[i]).norm();
    if (std::isnan(distance)) distance = std::numeric_limits<double>::infinity();
    if (i > 0 && distance <= worst.distance) continue;
    worst.particle = i;
    worst.distance = distance;
  }
  if (actual.empty()) return worst;
  std::ostringstream message;
  message << std::setprecision(17) << "particle " << worst.particle << " of " << actual.size()
          << ": (" << actual[worst.particle].transpose() << ") instead of ("
          << expected[worst.particle].transpose() << "), off by " << worst.distance;
  worst.message = message.str();
  return worst;
}

}  // namespace drape::test
