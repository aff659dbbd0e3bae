#include "server/scene/convex_polytope.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace drape {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// What is off a plane or a line by less than this is on it [-], of the size of the mesh: a rounding
// of positions in single precision. Larger: faces that bulge count as flat, and touch too early;
// smaller: a box from a file has twelve faces.
constexpr double kFlatness = 1e-6;

struct Plane {
  Vector3d normal;
  double offset_m = 0;
};

// Distinct planes of triangles; none if there are too many.
std::optional<std::vector<Plane>> PlanesOf(const TriangleMesh& mesh, double slack_m) {
  std::vector<Plane> planes;
  for (const auto& triangle : mesh.triangles) {
    const Vector3d& a = mesh.positions_m[triangle[0]];
    const Vector3d& b = mesh.positions_m[triangle[1]];
    const Vector3d& c = mesh.positions_m[triangle[2]];
    const Vector3d cross = (b - a).cross(c - a);
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    if (cross.norm() <= slack_m * longest) continue;  // a line: its plane is anything
    const Vector3d normal = cross.normalized();
    const auto holds = [&](const Plane& plane) {
      const auto is_on = [&](const Vector3d& p) {
        return std::abs(plane.normal.dot(p) - plane.offset_m) <= slack_m;
      };
      return plane.normal.dot(normal) > 0 && is_on(a) && is_on(b) && is_on(c);
    };
    if (std::ranges::any_of(planes, holds)) continue;
    if (planes.size() == ConvexPolytope::kMostFaces) return std::nullopt;
    planes.push_back({normal, normal.dot(a)});
  }
  return planes;
}

// The outline of the points on a plane (Andrew's monotone chain, 1979), counter-clockwise.
std::vector<uint32_t> OutlineOf(const std::vector<Vector3d>& points, const Plane& plane,
                                double slack_m) {
  const Vector3d u = plane.normal.unitOrthogonal(), v = plane.normal.cross(u);
  struct Seen {
    Vector2d at;
    uint32_t point;
  };
  std::vector<Seen> seen;
  for (uint32_t p = 0; p < points.size(); ++p) {
    if (std::abs(plane.normal.dot(points[p]) - plane.offset_m) > slack_m) continue;
    seen.push_back({Vector2d(u.dot(points[p]), v.dot(points[p])), p});
  }
  std::ranges::sort(seen, [](const Seen& a, const Seen& b) {
    return std::pair(a.at.x(), a.at.y()) < std::pair(b.at.x(), b.at.y());
  });
  // A corner stays if it is to the right of the line past it by more than the slack.
  const auto half = [&](auto begin, auto end) {
    std::vector<Seen> chain;
    for (auto each = begin; each != end; ++each) {
      if (!chain.empty() && (each->at - chain.back().at).norm() <= slack_m) continue;
      while (chain.size() > 1) {
        const Vector2d along = each->at - chain[chain.size() - 2].at;
        const Vector2d to = chain.back().at - chain[chain.size() - 2].at;
        if (to.x() * along.y() - to.y() * along.x() > slack_m * along.norm()) break;
        chain.pop_back();
      }
      chain.push_back(*each);
    }
    return chain;
  };
  std::vector<uint32_t> outline;
  for (const auto& chain : {half(seen.begin(), seen.end()), half(seen.rbegin(), seen.rend())}) {
    for (size_t k = 0; k + 1 < chain.size(); ++k) outline.push_back(chain[k].point);
  }
  return outline;
}

}  // namespace

uint64_t ConvexPolytope::size_bytes() const {
  uint64_t bytes = sizeof(*this) + (corners_m.size() + edge_directions.size()) * sizeof(Vector3d);
  for (const Face& face : faces) bytes += sizeof(face) + face.corners.size() * sizeof(uint32_t);
  return bytes;
}

std::shared_ptr<const ConvexPolytope> PolytopeOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) box.extend(mesh.positions_m[vertex]);
  }
  const double slack_m = kFlatness * box.diagonal().norm();
  const auto planes = PlanesOf(mesh, slack_m);
  if (!planes) return nullptr;
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) {
      for (const Plane& plane : *planes) {
        const double over = plane.normal.dot(mesh.positions_m[vertex]) - plane.offset_m;
        if (over > slack_m) return nullptr;
      }
    }
  }
  const auto polytope = std::make_shared<ConvexPolytope>();
  std::vector<uint32_t> corner_of(mesh.positions_m.size(), UINT32_MAX);
  for (const Plane& plane : *planes) {
    ConvexPolytope::Face face{.normal = plane.normal,
                              .corners = OutlineOf(mesh.positions_m, plane, slack_m)};
    if (face.corners.size() < 3 || face.corners.size() > ConvexPolytope::kMostCornersOfFace) {
      return nullptr;
    }
    for (size_t k = 0; k < face.corners.size(); ++k) {
      const Vector3d& from = mesh.positions_m[face.corners[k]];
      const Vector3d& to = mesh.positions_m[face.corners[(k + 1) % face.corners.size()]];
      const Vector3d along = (to - from).normalized();
      const auto is_same = [&](const Vector3d& other) {
        return other.cross(along).norm() <= kFlatness;
      };
      if (std::ranges::none_of(polytope->edge_directions, is_same)) {
        polytope->edge_directions.push_back(along);
      }
    }
    for (uint32_t& corner : face.corners) {
      uint32_t& known = corner_of[corner];
      if (known == UINT32_MAX) {
        known = static_cast<uint32_t>(polytope->corners_m.size());
        polytope->corners_m.push_back(mesh.positions_m[corner]);
      }
      corner = known;
    }
    polytope->faces.push_back(std::move(face));
  }
  return polytope;
}

}  // namespace drape
