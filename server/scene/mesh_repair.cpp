#include "server/scene/mesh_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <unordered_map>

#include "server/core/keyed_hash.h"
#include "server/scene/mesh.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<uint32_t, 3>;

constexpr uint32_t kNoVertex = ~0u;
// A flip must raise the flatter of the two triangles by this factor: no flip is taken back.
constexpr double kLeastGain = 2;
// Rounds of collapses, each of edges that share no vertex. Defects need a few: a cluster of n
// vertices log2(n). Where thousands of triangles share one vertex, and their far sides are long, a
// round removes one of them; what is left of them then stays.
constexpr int kMaxCollapseRounds = 64;
// Rounds of flips, each of edges that share no triangle.
constexpr int kMaxFlipRounds = 10;

double Length(const TriangleMesh& mesh, const MeshEdge& edge) {
  return (mesh.positions_m[edge.i] - mesh.positions_m[edge.j]).norm();
}

// Height over the longest edge, over that edge.
double Flatness(const std::vector<Vector3d>& positions_m, const Triangle& t) {
  const Vector3d &a = positions_m[t[0]], &b = positions_m[t[1]], &c = positions_m[t[2]];
  const double longest_sq =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return longest_sq > 0 ? 2 * TriangleArea(a, b, c) / longest_sq : 0;
}

// Whether `t` runs from i to j.
bool RunsAlong(const Triangle& t, uint32_t i, uint32_t j) {
  for (int corner = 0; corner < 3; ++corner) {
    if (t[corner] == i && t[(corner + 1) % 3] == j) return true;
  }
  return false;
}

uint64_t EdgeKey(uint32_t i, uint32_t j) {
  return (uint64_t{std::min(i, j)} << 32) | std::max(i, j);
}

using EdgeTriangles = std::unordered_map<uint64_t, std::vector<uint32_t>, KeyedHash>;

// The triangles at each edge, ascending.
EdgeTriangles TrianglesAtEdges(const std::vector<Triangle>& triangles) {
  EdgeTriangles by_edge;
  by_edge.reserve(triangles.size() * 3 / 2);
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      by_edge[EdgeKey(triangles[t][corner], triangles[t][(corner + 1) % 3])].push_back(t);
    }
  }
  return by_edge;
}

class Repair {
 public:
  explicit Repair(const TriangleMesh& drawn)
      : drawn_(drawn), mesh_(drawn), stands_for_(drawn.positions_m.size()) {
    std::iota(stands_for_.begin(), stands_for_.end(), uint32_t{0});
    member_count_.assign(stands_for_.size(), 1);
  }

  RepairedMesh Run(Interruption* interruption) {
    DropTriangles();
    Ask(interruption);
    const double typical_m = LeastTypicalEdge_m(mesh_);
    Ask(interruption);
    Weld(kWeldShare * typical_m);
    Ask(interruption);
    Collapse(kCollapseShare * typical_m);
    Ask(interruption);
    TurnCaps();
    Ask(interruption);
    Orient();
    Ask(interruption);
    for (const MeshEdge& edge : UniqueEdges(mesh_.triangles)) {
      counts_.non_manifold_edges += edge.opposite_vertices.size() > 2;
    }
    const size_t dropped = drawn_.triangles.size() - mesh_.triangles.size();
    counts_.dropped_triangles = static_cast<uint32_t>(dropped);
    CountLooseVertices();
    return Renumbered();
  }

 private:
  // Those without area, and those that an earlier one has the same corners as.
  void DropTriangles() {
    std::set<Triangle> seen;
    std::erase_if(mesh_.triangles, [&](const Triangle& triangle) {
      if (IsDegenerate(mesh_, triangle)) return true;
      Triangle corners = triangle;
      std::sort(corners.begin(), corners.end());
      return !seen.insert(corners).second;
    });
  }

  // `from` at the mean of the drawn positions of all that are one now.
  void Merge(uint32_t to, uint32_t from) {
    if (from < to) std::swap(to, from);
    const double a = member_count_[to], b = member_count_[from];
    mesh_.positions_m[to] = (a * mesh_.positions_m[to] + b * mesh_.positions_m[from]) / (a + b);
    member_count_[to] += member_count_[from];
    stands_for_[from] = to;
  }

  uint32_t Find(uint32_t v) {
    while (stands_for_[v] != v) v = stands_for_[v] = stands_for_[stands_for_[v]];
    return v;
  }

  void MoveCorners() {
    for (Triangle& triangle : mesh_.triangles) {
      for (uint32_t& corner : triangle) corner = Find(corner);
    }
    DropTriangles();
  }

  std::vector<uint32_t> BorderVertices() const {
    std::vector<bool> is_border(mesh_.positions_m.size());
    for (const MeshEdge& edge : UniqueEdges(mesh_.triangles)) {
      if (edge.opposite_vertices.size() == 1) is_border[edge.i] = is_border[edge.j] = true;
    }
    std::vector<uint32_t> vertices;
    for (uint32_t v = 0; v < is_border.size(); ++v) {
      if (is_border[v]) vertices.push_back(v);
    }
    return vertices;
  }

  // Each vertex joins the first one that stays and is near enough. Those that stay are apart, so a
  // cell has few of them.
  void Weld(double tolerance_m) {
    if (tolerance_m == 0) return;
    std::unordered_map<uint64_t, std::vector<uint32_t>, KeyedHash> cells;
    const auto key = [](const std::array<int64_t, 3>& c) {
      uint64_t of_all = 0;
      for (const int64_t k : c) of_all = KeyedHash()(of_all ^ static_cast<uint64_t>(k));
      return of_all;
    };
    for (const uint32_t v : BorderVertices()) {
      const Vector3d& p = drawn_.positions_m[v];
      std::array<int64_t, 3> cell;
      for (size_t k = 0; k < 3; ++k) {
        cell[k] = std::llround(std::floor(p[static_cast<Eigen::Index>(k)] / tolerance_m));
      }
      uint32_t first = kNoVertex;
      for (int n = 0; n < 27; ++n) {
        const auto near =
            cells.find(key({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1}));
        if (near == cells.end()) continue;
        for (const uint32_t other : near->second) {
          const double distance_m = (drawn_.positions_m[other] - p).norm();
          if (distance_m <= tolerance_m) first = std::min(first, other);
        }
      }
      if (first == kNoVertex) {
        cells[key(cell)].push_back(v);
      } else {
        Merge(first, v);
        ++counts_.welded_vertices;
      }
    }
    if (counts_.welded_vertices > 0) MoveCorners();
  }

  // The shortest edges first, in rounds of edges that share no vertex: lengths change on the way.
  void Collapse(double limit_m) {
    for (int round = 0; round < kMaxCollapseRounds; ++round) {
      std::vector<std::pair<double, MeshEdge>> shorts;
      for (MeshEdge& edge : UniqueEdges(mesh_.triangles)) {
        const double length_m = Length(mesh_, edge);
        if (length_m < limit_m) shorts.emplace_back(length_m, std::move(edge));
      }
      if (shorts.empty()) return;
      std::stable_sort(shorts.begin(), shorts.end(),
                       [](const auto& a, const auto& b) { return a.first < b.first; });
      std::vector<bool> is_moved(mesh_.positions_m.size());
      for (const auto& [length_m, edge] : shorts) {
        if (is_moved[edge.i] || is_moved[edge.j]) continue;
        is_moved[edge.i] = is_moved[edge.j] = true;
        Merge(edge.i, edge.j);
        ++counts_.collapsed_vertices;
      }
      MoveCorners();
    }
  }

  struct Cap {
    double flatness = 0;
    uint32_t triangle = 0;
    int corner = 0;  // the apex
  };

  std::vector<Cap> FindCaps() const {
    std::vector<Cap> caps;
    const std::vector<Vector3d>& p = mesh_.positions_m;
    for (uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& triangle = mesh_.triangles[t];
      const double flatness = Flatness(p, triangle);
      if (flatness >= kCapShare) continue;
      for (int corner = 0; corner < 3; ++corner) {
        const Vector3d to_a = p[triangle[(corner + 1) % 3]] - p[triangle[corner]];
        const Vector3d to_b = p[triangle[(corner + 2) % 3]] - p[triangle[corner]];
        if (to_a.dot(to_b) < 0) caps.push_back({flatness, t, corner});
      }
    }
    std::stable_sort(caps.begin(), caps.end(),
                     [](const Cap& a, const Cap& b) { return a.flatness < b.flatness; });
    return caps;
  }

  // The edge opposite the apex of a cap is replaced by the one from the apex to the other side; a
  // cap at the border goes.
  void TurnCaps() {
    for (int round = 0; round < kMaxFlipRounds; ++round) {
      const std::vector<Cap> caps = FindCaps();
      if (caps.empty()) return;
      const auto by_edge = TrianglesAtEdges(mesh_.triangles);
      std::vector<uint32_t> triangle_count(mesh_.positions_m.size(), 0);
      for (const Triangle& triangle : mesh_.triangles) {
        for (const uint32_t corner : triangle) ++triangle_count[corner];
      }
      std::vector<bool> is_done(mesh_.triangles.size()), is_dropped(mesh_.triangles.size());
      bool is_any_changed = false;
      for (const Cap& cap : caps) {
        if (is_done[cap.triangle]) continue;  // it has turned with a neighbour, and has other edges
        const Triangle triangle = mesh_.triangles[cap.triangle];
        const auto [c, a, b] = std::array{triangle[cap.corner], triangle[(cap.corner + 1) % 3],
                                          triangle[(cap.corner + 2) % 3]};
        const std::vector<uint32_t>& sides = by_edge.at(EdgeKey(a, b));
        const bool is_free = std::ranges::none_of(sides, [&](uint32_t t) { return is_done[t]; });
        if (!is_free) continue;
        if (sides.size() == 1) {
          if (triangle_count[a] < 2 || triangle_count[b] < 2 || triangle_count[c] < 2) continue;
          for (const uint32_t corner : triangle) --triangle_count[corner];
          is_done[cap.triangle] = is_dropped[cap.triangle] = is_any_changed = true;
        } else if (sides.size() == 2) {
          const uint32_t other = sides[0] == cap.triangle ? sides[1] : sides[0];
          if (!Flip(c, a, b, cap, other, by_edge)) continue;
          is_done[cap.triangle] = is_done[other] = is_any_changed = true;
        }
      }
      if (!is_any_changed) return;
      size_t t = 0;
      std::erase_if(mesh_.triangles, [&](const Triangle&) { return is_dropped[t++]; });
    }
  }

  // The triangles c a b and b a d become c a d and c d b.
  bool Flip(uint32_t c, uint32_t a, uint32_t b, const Cap& cap, uint32_t other,
            const EdgeTriangles& by_edge) {
    Triangle& second = mesh_.triangles[other];
    const uint32_t d = second[0] + second[1] + second[2] - a - b;
    if (c == d || by_edge.contains(EdgeKey(c, d))) return false;
    const bool is_turned = !RunsAlong(second, b, a);  // mixed winding is mended later
    const Triangle left = {c, a, d}, right = {c, d, b};
    const double before = std::min(cap.flatness, Flatness(mesh_.positions_m, second));
    const double after =
        std::min(Flatness(mesh_.positions_m, left), Flatness(mesh_.positions_m, right));
    if (after < kLeastGain * before || after == 0) return false;
    mesh_.triangles[cap.triangle] = left;
    second = is_turned ? Triangle{d, c, b} : right;
    ++counts_.flipped_edges;
    return true;
  }

  // Across the edges of two triangles, part by part; the smaller share of a part turns. Parts that
  // have no two sides (a Moebius strip) keep an edge where they disagree.
  void Orient() {
    const auto by_edge = TrianglesAtEdges(mesh_.triangles);
    std::vector<int8_t> sides(mesh_.triangles.size(), 0);  // 1 as drawn, -1 turned
    for (uint32_t first = 0; first < sides.size(); ++first) {
      if (sides[first] != 0) continue;
      std::vector<uint32_t> part = {first};
      sides[first] = 1;
      size_t turned = 0;
      for (size_t k = 0; k < part.size(); ++k) {
        const Triangle& t = mesh_.triangles[part[k]];
        turned += sides[part[k]] < 0;
        for (int corner = 0; corner < 3; ++corner) {
          const uint32_t i = t[corner], j = t[(corner + 1) % 3];
          const std::vector<uint32_t>& pair = by_edge.at(EdgeKey(i, j));
          if (pair.size() != 2) continue;
          const uint32_t other = pair[0] == part[k] ? pair[1] : pair[0];
          if (sides[other] != 0) continue;
          const bool is_opposed = RunsAlong(mesh_.triangles[other], i, j);
          sides[other] = static_cast<int8_t>(is_opposed ? -sides[part[k]] : sides[part[k]]);
          part.push_back(other);
        }
      }
      const int8_t to_turn = 2 * turned > part.size() ? 1 : -1;
      for (const uint32_t t : part) {
        if (sides[t] != to_turn) continue;
        std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
        ++counts_.turned_triangles;
      }
    }
  }

  void CountLooseVertices() {
    std::vector<bool> has_triangle(stands_for_.size());
    for (const Triangle& triangle : mesh_.triangles) {
      for (const uint32_t corner : triangle) has_triangle[corner] = true;
    }
    for (uint32_t v = 0; v < stands_for_.size(); ++v) {
      counts_.loose_vertices += !has_triangle[Find(v)];
    }
  }

  RepairedMesh Renumbered() {
    RepairedMesh repaired;
    repaired.counts = counts_;
    if (counts_.welded_vertices + counts_.collapsed_vertices == 0) {
      repaired.mesh = std::move(mesh_);
      return repaired;
    }
    std::vector<uint32_t> numbers(stands_for_.size(), kNoVertex);
    for (uint32_t v = 0; v < stands_for_.size(); ++v) {
      const uint32_t stay = Find(v);
      if (numbers[stay] == kNoVertex) {
        numbers[stay] = static_cast<uint32_t>(repaired.mesh.positions_m.size());
        repaired.mesh.positions_m.push_back(mesh_.positions_m[stay]);
      }
      repaired.vertex_of_drawn.push_back(numbers[stay]);
      const double shift_m = (mesh_.positions_m[stay] - drawn_.positions_m[v]).norm();
      repaired.counts.largest_shift_m = std::max(repaired.counts.largest_shift_m, shift_m);
    }
    repaired.mesh.triangles = std::move(mesh_.triangles);
    for (Triangle& triangle : repaired.mesh.triangles) {
      for (uint32_t& corner : triangle) corner = numbers[corner];
    }
    return repaired;
  }

  const TriangleMesh& drawn_;
  TriangleMesh mesh_;
  std::vector<uint32_t> stands_for_;    // [vertex] a lower one, or itself
  std::vector<uint32_t> member_count_;  // [vertex] that it stands for
  MeshRepairCounts counts_;
};

}  // namespace

double LeastTypicalEdge_m(const TriangleMesh& mesh) {
  std::vector<double> lengths_m;
  for (const MeshEdge& edge : UniqueEdges(mesh.triangles)) lengths_m.push_back(Length(mesh, edge));
  if (lengths_m.empty()) return 0;
  const auto tenth = lengths_m.begin() + static_cast<std::ptrdiff_t>(lengths_m.size() / 10);
  std::nth_element(lengths_m.begin(), tenth, lengths_m.end());
  return *tenth;
}

RepairedMesh RepairMesh(const TriangleMesh& drawn, Interruption* interruption) {
  return Repair(drawn).Run(interruption);
}

}  // namespace drape
