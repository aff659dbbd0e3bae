#include "server/solver/self_contact/exact_orientation.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace drape::self_contact {
namespace {

// A sum of doubles that do not overlap, smallest first: exact (Shewchuk 1997, «Adaptive Precision
// Floating-Point Arithmetic and Fast Robust Geometric Predicates»).
using Expansion = std::vector<double>;

// sum = a + b rounded; sum + error is exact.
struct Split {
  double sum, error;
};
Split TwoSum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}
Split TwoProduct(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

void Grow(Expansion& e, double b) {
  double carry = b;
  for (double& component : e) {
    const Split split = TwoSum(carry, component);
    carry = split.sum;
    component = split.error;
  }
  e.push_back(carry);
  std::erase(e, 0.0);
}

Expansion Sum(Expansion a, const Expansion& b) {
  for (const double component : b) Grow(a, component);
  return a;
}

Expansion Product(const Expansion& a, const Expansion& b) {
  Expansion result;
  for (const double x : a) {
    for (const double y : b) {
      const Split split = TwoProduct(x, y);
      Grow(result, split.error);
      Grow(result, split.sum);
    }
  }
  return result;
}

Expansion Negative(Expansion e) {
  for (double& component : e) component = -component;
  return e;
}

Expansion Difference(double a, double b) {
  const Split split = TwoSum(a, -b);
  Expansion result;
  Grow(result, split.error);
  Grow(result, split.sum);
  return result;
}

int SignOf(const Expansion& e) {
  if (e.empty()) return 0;
  return e.back() > 0 ? 1 : -1;
}

int ExactOrientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& d) {
  std::array<std::array<Expansion, 3>, 3> rows;
  for (int axis = 0; axis < 3; ++axis) {
    rows[0][axis] = Difference(b[axis], a[axis]);
    rows[1][axis] = Difference(c[axis], a[axis]);
    rows[2][axis] = Difference(d[axis], a[axis]);
  }
  Expansion determinant;
  for (int axis = 0; axis < 3; ++axis) {
    const int next = (axis + 1) % 3, last = (axis + 2) % 3;
    const Expansion minor =
        Sum(Product(rows[0][next], rows[1][last]), Negative(Product(rows[0][last], rows[1][next])));
    determinant = Sum(determinant, Product(minor, rows[2][axis]));
  }
  return SignOf(determinant);
}

}  // namespace

int Orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ad = d - a;
  const double xy = ab.x() * ac.y(), yx = ab.y() * ac.x();
  const double yz = ab.y() * ac.z(), zy = ab.z() * ac.y();
  const double zx = ab.z() * ac.x(), xz = ab.x() * ac.z();
  const double determinant = (yz - zy) * ad.x() + (zx - xz) * ad.y() + (xy - yx) * ad.z();
  const double size = (std::fabs(yz) + std::fabs(zy)) * std::fabs(ad.x()) +
                      (std::fabs(zx) + std::fabs(xz)) * std::fabs(ad.y()) +
                      (std::fabs(xy) + std::fabs(yx)) * std::fabs(ad.z());
  // Shewchuk's bound for this formula is a little above 7 halves of epsilon.
  if (std::fabs(determinant) > 8 * std::numeric_limits<double>::epsilon() * size) {
    return determinant > 0 ? 1 : -1;
  }
  return ExactOrientation(a, b, c, d);
}

bool Crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  if (Orientation(a, b, c, p) * Orientation(a, b, c, q) >= 0) return false;
  const int ab = Orientation(p, q, a, b), bc = Orientation(p, q, b, c),
            ca = Orientation(p, q, c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

}  // namespace drape::self_contact
