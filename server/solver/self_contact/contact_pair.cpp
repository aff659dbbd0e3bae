#include "server/solver/self_contact/contact_pair.h"

namespace drape::self_contact {
namespace {

// The direction across both edges, or that of the triangle's normal, that points from the second
// primitive to the first; 0 if there is none.
Vector3d Across(PairKind kind, const std::array<Vector3d, 4>& p, const Vector3d& difference) {
  const Vector3d cross = kind == PairKind::kEdges
                             ? Cross(Vector3d(p[1] - p[0]), Vector3d(p[3] - p[2]))
                             : Cross(Vector3d(p[2] - p[1]), Vector3d(p[3] - p[1]));
  const double length = Length(cross);
  if (!(length > 0)) return Vector3d{};
  return Dot(cross, difference) >= 0 ? Vector3d(cross / length) : Vector3d(-cross / length);
}

template <class V>
std::array<Vector3d, 4> InDouble(const std::array<V, 4>& p) {
  std::array<Vector3d, 4> result;
  for (int k = 0; k < 4; ++k)
    result[k] = Vector3d{double{p[k][0]}, double{p[k][1]}, double{p[k][2]}, 0};
  return result;
}

// Slower, with all digits.
template <class V>
bool FindNormalExactly(const std::array<V, 4>& corners, ContactPair<V>& pair) {
  using Real = ScalarOf<V>;
  const std::array<Vector3d, 4> p = InDouble(corners);
  const ClosestPoints<Vector3d> closest = Closest(pair.kind, p);
  const double distance = Length(closest.difference);
  for (int k = 0; k < 4; ++k) pair.weights[k] = static_cast<Real>(closest.weights[k]);
  const Vector3d direct = distance > 0 ? Vector3d(closest.difference / distance) : Vector3d{};
  const Vector3d across = Across(pair.kind, p, closest.difference);
  const double direct_gap = GapAlong(pair.kind, p, direct);
  const double across_gap = GapAlong(pair.kind, p, across);
  const Vector3d& best = direct_gap >= across_gap ? direct : across;
  pair.normal =
      V{static_cast<Real>(best[0]), static_cast<Real>(best[1]), static_cast<Real>(best[2]), 0};
  pair.gap = GapAlong(pair.kind, corners, pair.normal);
  return pair.gap > 0;
}

// The gap along the direction of the nearest points is their distance; less than this share of it
// says that rounding has spoilt the direction [-].
template <class Real>
constexpr Real kTrueShare = Real{0.9375};

template <class V>
void FindInverseMass(std::span<const ScalarOf<V>> inverse_masses, ContactPair<V>& pair) {
  pair.inverse_mass = 0;
  for (int k = 0; k < 4; ++k) {
    pair.inverse_mass += pair.weights[k] * pair.weights[k] * inverse_masses[pair.particles[k]];
  }
}

}  // namespace

template <class V>
bool FindNormal(const V* positions, std::span<const ScalarOf<V>> inverse_masses,
                ContactPair<V>& pair) {
  using Real = ScalarOf<V>;
  const std::array<V, 4> corners = CornersOf(pair, positions);
  const ClosestPoints<V> closest = Closest(pair.kind, corners);
  const Real distance = Length(closest.difference);
  bool is_apart = false;
  if (distance > 0) {
    pair.weights = closest.weights;
    pair.normal = closest.difference / distance;
    pair.gap = GapAlong(pair.kind, corners, pair.normal);
    is_apart = pair.gap > kTrueShare<Real> * distance;
  }
  if (!is_apart) is_apart = FindNormalExactly(corners, pair);
  FindInverseMass<V>(inverse_masses, pair);
  return is_apart;
}

template <class V>
uint32_t FindNormals(const V* positions, std::span<const ScalarOf<V>> inverse_masses, PairKind kind,
                     std::span<ContactPair<V>* const> pairs) {
  FourPairs particles;
  for (size_t lane = 0; lane < kPairsSideBySide; ++lane) {
    particles[lane] = &pairs[std::min(lane, pairs.size() - 1)]->particles;
  }
  const FourCorners<V> corners = CornersOf(particles, positions);
  const FourClosestPoints<V> closest = Closest<V>(kind, corners);
  const V distances = RootOf(Dot(closest.difference, closest.difference));
  const FourPoints<V> normals = closest.difference / distances;
  const V gaps = GapAlong(kind, corners, normals);
  uint32_t are_apart = BitsOf((distances > 0) & (gaps > kTrueShare<ScalarOf<V>> * distances));
  for (uint32_t lane = 0; lane < pairs.size(); ++lane) {
    ContactPair<V>& pair = *pairs[lane];
    for (int k = 0; k < 4; ++k) pair.weights[k] = closest.weights[k][lane];
    pair.normal = V{normals.x[lane], normals.y[lane], normals.z[lane], 0};
    pair.gap = gaps[lane];
    if ((are_apart >> lane & 1) == 0 && FindNormalExactly(CornersOf(pair, positions), pair)) {
      are_apart |= 1u << lane;
    }
    FindInverseMass<V>(inverse_masses, pair);
  }
  return are_apart;
}

template bool FindNormal(const Vector3f*, std::span<const float>, ContactPair<Vector3f>&);
template bool FindNormal(const Vector3d*, std::span<const double>, ContactPair<Vector3d>&);
template uint32_t FindNormals(const Vector3f*, std::span<const float>, PairKind,
                              std::span<ContactPair<Vector3f>* const>);
template uint32_t FindNormals(const Vector3d*, std::span<const double>, PairKind,
                              std::span<ContactPair<Vector3d>* const>);

}  // namespace drape::self_contact
