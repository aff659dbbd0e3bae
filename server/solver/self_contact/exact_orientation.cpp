#include "server/solver/self_contact/exact_orientation.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace drape::self_contact {
namespace {

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

// A sum of doubles that do not overlap, smallest first, none of them 0: exact (Shewchuk 1997,
// «Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates»). At most so
// many.
template <int kMost>
class Expansion {
 public:
  std::span<const double> components() const {
    return std::span(components_).first(static_cast<size_t>(size_));
  }

  void Add(double b) {
    double carry = b;
    int kept = 0;
    for (int k = 0; k < size_; ++k) {
      const Split split = TwoSum(carry, components_[k]);
      carry = split.sum;
      if (split.error != 0) components_[kept++] = split.error;
    }
    if (carry != 0) components_[kept++] = carry;
    size_ = kept;
  }

  int Sign() const {
    if (size_ == 0) return 0;
    return components_[size_ - 1] > 0 ? 1 : -1;
  }

 private:
  // Not cleared: most are short.
  std::array<double, kMost> components_;
  int size_ = 0;
};

Expansion<2> Difference(double a, double b) {
  const Split split = TwoSum(a, -b);
  Expansion<2> result;
  result.Add(split.error);
  result.Add(split.sum);
  return result;
}

// Adds a * b, or the negative of it.
template <int kMost, class A, class B>
void AddProduct(const A& a, const B& b, double sign, Expansion<kMost>& sum) {
  for (const double x : a.components()) {
    for (const double y : b.components()) {
      const Split split = TwoProduct(sign * x, y);
      sum.Add(split.error);
      sum.Add(split.sum);
    }
  }
}

int ExactOrientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& d) {
  std::array<std::array<Expansion<2>, 3>, 3> rows;
  for (int axis = 0; axis < 3; ++axis) {
    rows[0][axis] = Difference(b[axis], a[axis]);
    rows[1][axis] = Difference(c[axis], a[axis]);
    rows[2][axis] = Difference(d[axis], a[axis]);
  }
  Expansion<192> determinant;
  for (int axis = 0; axis < 3; ++axis) {
    const int next = (axis + 1) % 3, last = (axis + 2) % 3;
    Expansion<16> minor;
    AddProduct(rows[0][next], rows[1][last], 1, minor);
    AddProduct(rows[0][last], rows[1][next], -1, minor);
    AddProduct(minor, rows[2][axis], 1, determinant);
  }
  return determinant.Sign();
}

// The sign, if rounding does not hide it.
std::optional<int> QuickOrientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
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
  // Four points in a plane across an axis, as cloths that have just been laid down.
  for (int axis = 0; axis < 3; ++axis) {
    if (ab[axis] == 0 && ac[axis] == 0 && ad[axis] == 0) return 0;
  }
  return std::nullopt;
}

// On which side of the line from a to b the point c lies, in the plane of two axes; 0: on it, or
// rounding hides it.
int QuickSide(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, int x,
              int y) {
  const double left = (a[x] - c[x]) * (b[y] - c[y]), right = (a[y] - c[y]) * (b[x] - c[x]);
  const double size = std::fabs(left) + std::fabs(right);
  // Shewchuk's bound for this formula is a little above 3 halves of epsilon.
  if (std::fabs(left - right) <= 2 * std::numeric_limits<double>::epsilon() * size) return 0;
  return left > right ? 1 : -1;
}

// Whether a side of the triangle is certainly between it and the edge, looked at along an axis:
// then they do not meet, whatever their places along that axis. Most edges of a flat sheet are so
// far from the triangles beside them.
bool AreApartAlongAnAxis(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                         const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a).cwiseAbs();
  int axis = 0;
  normal.maxCoeff(&axis);
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const int inside = QuickSide(a, b, c, x, y);
  if (inside == 0) return false;
  const auto is_beyond = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return QuickSide(from, to, p, x, y) == -inside && QuickSide(from, to, q, x, y) == -inside;
  };
  return is_beyond(a, b) || is_beyond(b, c) || is_beyond(c, a);
}

int CountedOrientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d, uint32_t& exact) {
  if (const std::optional<int> sign = QuickOrientation(a, b, c, d)) return *sign;
  ++exact;
  return ExactOrientation(a, b, c, d);
}

}  // namespace

int Orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d) {
  uint32_t exact = 0;
  return CountedOrientation(a, b, c, d, exact);
}

bool Crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c, uint32_t& exact) {
  const std::optional<int> quick_above = QuickOrientation(a, b, c, p);
  if (quick_above == 0 || (!quick_above && AreApartAlongAnAxis(p, q, a, b, c))) return false;
  const int above = quick_above ? *quick_above : CountedOrientation(a, b, c, p, exact);
  if (above == 0 || above * CountedOrientation(a, b, c, q, exact) >= 0) return false;
  const int ab = CountedOrientation(p, q, a, b, exact);
  const int bc = CountedOrientation(p, q, b, c, exact);
  if (ab * bc < 0) return false;
  const int ca = CountedOrientation(p, q, c, a, exact);
  return ab * ca >= 0 && bc * ca >= 0;
}

bool Crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  uint32_t exact = 0;
  return Crosses(p, q, a, b, c, exact);
}

}  // namespace drape::self_contact
