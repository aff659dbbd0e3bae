#include "server/solver/self_contact/contact_surface.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace drape {
namespace {

using self_contact::PairKind;
using self_contact::Vector3d;

constexpr uint32_t kNone = UINT32_MAX;

std::array<uint32_t, 2> Edge(uint32_t i, uint32_t j) {
  return {std::min(i, j), std::max(i, j)};
}

// [triangle][edge]: the other triangle at the edge, or none. Of more than two triangles at an edge,
// the first two are neighbours.
std::vector<std::array<uint32_t, 3>> TrianglesAcrossEdges(
    std::span<const std::array<uint32_t, 3>> triangles) {
  std::vector<std::array<uint32_t, 3>> across(triangles.size(), {kNone, kNone, kNone});
  std::map<std::array<uint32_t, 2>, std::pair<uint32_t, int>> open;
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto edge = Edge(triangles[t][k], triangles[t][(k + 1) % 3]);
      const auto [place, is_new] = open.try_emplace(edge, t, k);
      if (is_new) continue;
      const auto [other, other_edge] = place->second;
      if (across[other][other_edge] != kNone) continue;
      across[t][k] = other;
      across[other][other_edge] = t;
    }
  }
  return across;
}

template <class T>
void SortUnique(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace

ContactSurface::ContactSurface(const SceneModel& model, Interruption* interruption)
    : triangles_(model.triangles().begin(), model.triangles().end()) {
  for (const Eigen::Vector3d& p : model.rest_positions_m()) {
    rest_positions_.push_back(self_contact::ToVector<Vector3d>(p));
  }
  for (const auto& [i, j, k] : triangles_) {
    const Vector3d to_j = rest_positions_[j] - rest_positions_[i];
    const Vector3d to_k = rest_positions_[k] - rest_positions_[i];
    const double longest = std::max({self_contact::Length(to_j), self_contact::Length(to_k),
                                     self_contact::Length(Vector3d(to_k - to_j))});
    const double double_area = self_contact::Length(self_contact::Cross(to_j, to_k));
    rest_heights_.push_back(longest > 0 ? double_area / longest : 0);
  }
  Ask(interruption);
  FindEdges();
  Ask(interruption);
  FindCornersAround();
  GrowPatches(interruption);
  FindNeighbours(interruption);
  FindSurroundings();
  Ask(interruption);
  BuildTree();
  Ask(interruption);
  flat_sheet_ = self_contact::FlatSheet::Of(rest_positions_, triangles_);
}

ContactSurface::ContactSurface(std::span<const SurfaceMember> members, Interruption* interruption) {
  neighbour_offsets_.push_back(0);
  for (const SurfaceMember& member : members) Append(member, interruption);
  FindCornersAround();
  Ask(interruption);
  FindSurroundings();
  Ask(interruption);
  JoinTrees(members);
}

void ContactSurface::Append(const SurfaceMember& member, Interruption* interruption) {
  const ContactSurface& from = *member.surface;
  const auto size = [](const auto& list) { return static_cast<uint32_t>(list.size()); };
  const auto append = [](auto& list, const auto& more) {
    list.insert(list.end(), more.begin(), more.end());
  };
  const auto append_from = [](std::vector<uint32_t>& list, std::span<const uint32_t> more,
                              uint32_t first) {
    for (const uint32_t value : more) list.push_back(first + value);
  };
  const uint32_t particle = size(rest_positions_), triangle = size(triangles_), edge = size(edges_),
                 patch = size(patches_);
  const uint32_t patch_triangle = size(patch_triangles_), patch_edge = size(patch_edges_),
                 patch_vertex = size(patch_vertices_), patch_corner = size(patch_corners_);
  particle_members_.insert(particle_members_.end(), from.particle_count(), size(touches_itself_));
  touches_itself_.push_back(member.touches_itself);
  append(rest_positions_, from.rest_positions_);
  append(rest_heights_, from.rest_heights_);
  append(rest_boxes_, from.rest_boxes_);
  Ask(interruption);
  for (const auto& [i, j, k] : from.triangles_) {
    triangles_.push_back({particle + i, particle + j, particle + k});
  }
  for (const auto& [i, j] : from.edges_) edges_.push_back({particle + i, particle + j});
  Ask(interruption);
  append_from(patch_triangles_, from.patch_triangles_, triangle);
  append_from(patch_edges_, from.patch_edges_, edge);
  append_from(patch_vertices_, from.patch_vertices_, particle);
  append_from(patch_corners_, from.patch_corners_, particle);
  Ask(interruption);
  for (ContactPatch its : from.patches_) {
    for (uint32_t* const place : {&its.triangle_begin, &its.triangle_end}) *place += patch_triangle;
    for (uint32_t* const place : {&its.edge_begin, &its.edge_end}) *place += patch_edge;
    for (uint32_t* const place : {&its.vertex_begin, &its.vertex_end}) *place += patch_vertex;
    for (uint32_t* const place : {&its.corner_begin, &its.corner_end}) *place += patch_corner;
    patches_.push_back(its);
  }
  // What does not touch itself has no pairs with itself, hence no neighbours.
  for (uint32_t p = 0; p < from.patches_.size(); ++p) {
    for (uint32_t k = from.neighbour_offsets_[p];
         member.touches_itself && k < from.neighbour_offsets_[p + 1]; ++k) {
      ContactNeighbours its = from.neighbours_[k];
      its.first += patch;
      its.second += patch;
      neighbours_.push_back(its);
    }
    neighbour_offsets_.push_back(size(neighbours_));
  }
  Ask(interruption);
}

// Halves of the members above their own trees; children come after their parents.
void ContactSurface::JoinTrees(std::span<const SurfaceMember> members) {
  std::vector<uint32_t> with_patches, first_patches;
  uint32_t patches = 0;
  for (uint32_t m = 0; m < members.size(); ++m) {
    if (!members[m].surface->nodes_.empty()) with_patches.push_back(m);
    first_patches.push_back(patches);
    patches += static_cast<uint32_t>(members[m].surface->patches_.size());
  }
  if (with_patches.empty()) return;
  struct Open {
    uint32_t node;
    size_t begin, end;
  };
  nodes_.push_back({});
  node_members_.push_back(kSeveral);
  std::vector<Open> open = {{0, 0, with_patches.size()}};
  while (!open.empty()) {
    const auto [node, begin, end] = open.back();
    open.pop_back();
    const auto next = static_cast<uint32_t>(nodes_.size());
    if (end - begin > 1) {
      const size_t middle = begin + (end - begin) / 2;
      nodes_[node] = {next, 0};
      nodes_.insert(nodes_.end(), 2, ContactNode{});
      node_members_.insert(node_members_.end(), 2, kSeveral);
      open.push_back({next, begin, middle});
      open.push_back({next + 1, middle, end});
      continue;
    }
    // The root of the member is here, the rest of its tree at the end.
    const uint32_t m = with_patches[begin];
    const std::vector<ContactNode>& its = members[m].surface->nodes_;
    for (size_t k = 0; k < its.size(); ++k) {
      ContactNode moved = its[k];
      if (moved.first_child == 0) {
        moved.patch += first_patches[m];
      } else {
        moved.first_child += next - 1;
      }
      if (k == 0) {
        nodes_[node] = moved;
        node_members_[node] = m;
      } else {
        nodes_.push_back(moved);
        node_members_.push_back(m);
      }
    }
  }
}

void ContactSurface::FindEdges() {
  for (const auto& [i, j, k] : triangles_) {
    edges_.insert(edges_.end(), {Edge(i, j), Edge(j, k), Edge(k, i)});
  }
  SortUnique(edges_);
}

void ContactSurface::FindCornersAround() {
  corners_around_offsets_.assign(rest_positions_.size() + 1, 0);
  for (const auto& triangle : triangles_) {
    for (const uint32_t i : triangle) ++corners_around_offsets_[i + 1];
  }
  std::partial_sum(corners_around_offsets_.begin(), corners_around_offsets_.end(),
                   corners_around_offsets_.begin());
  corners_around_.resize(3 * triangles_.size());
  std::vector<uint32_t> next(corners_around_offsets_.begin(), corners_around_offsets_.end() - 1);
  for (const auto& [i, j, k] : triangles_) {
    corners_around_[next[i]++] = {j, k};
    corners_around_[next[j]++] = {k, i};
    corners_around_[next[k]++] = {i, j};
  }
}

// Each patch grows from its first triangle by the neighbour nearest to that.
void ContactSurface::GrowPatches(Interruption* interruption) {
  const auto across = TrianglesAcrossEdges(triangles_);
  SeldomInterruption seldom(interruption);
  const auto center = [&](uint32_t t) {
    const auto& [i, j, k] = triangles_[t];
    return Vector3d(rest_positions_[i] + rest_positions_[j] + rest_positions_[k]);
  };
  std::vector<bool> is_taken(triangles_.size(), false);
  std::vector<std::vector<uint32_t>> triangles_of_patches;
  for (uint32_t seed = 0; seed < triangles_.size(); ++seed) {
    seldom.Check();
    if (is_taken[seed]) continue;
    std::vector<uint32_t>& patch = triangles_of_patches.emplace_back(1, seed);
    is_taken[seed] = true;
    while (patch.size() < kPatchTriangles) {
      std::pair<double, uint32_t> nearest{std::numeric_limits<double>::infinity(), kNone};
      for (const uint32_t t : patch) {
        for (const uint32_t next : across[t]) {
          if (next == kNone || is_taken[next]) continue;
          nearest = std::min(
              nearest, {self_contact::SquaredLength(Vector3d(center(next) - center(seed))), next});
        }
      }
      if (nearest.second == kNone) break;
      patch.push_back(nearest.second);
      is_taken[nearest.second] = true;
    }
  }
  FillPatches(triangles_of_patches, interruption);
}

void ContactSurface::FillPatches(const std::vector<std::vector<uint32_t>>& triangles_of_patches,
                                 Interruption* interruption) {
  SeldomInterruption seldom(interruption);
  std::vector<bool> has_vertex(rest_positions_.size(), false);
  std::vector<bool> has_edge(edges_.size(), false);
  const auto size = [](const std::vector<uint32_t>& list) {
    return static_cast<uint32_t>(list.size());
  };
  for (const std::vector<uint32_t>& triangles : triangles_of_patches) {
    ContactPatch patch;
    patch.triangle_begin = size(patch_triangles_);
    patch.edge_begin = size(patch_edges_);
    patch.vertex_begin = size(patch_vertices_);
    patch.corner_begin = size(patch_corners_);
    std::vector<uint32_t> corners;
    for (const uint32_t t : triangles) {
      seldom.Check();
      patch_triangles_.push_back(t);
      for (int k = 0; k < 3; ++k) {
        const uint32_t i = triangles_[t][k];
        corners.push_back(i);
        if (!has_vertex[i]) patch_vertices_.push_back(i);
        has_vertex[i] = true;
        const auto edge = Edge(i, triangles_[t][(k + 1) % 3]);
        const auto place = std::lower_bound(edges_.begin(), edges_.end(), edge) - edges_.begin();
        if (!has_edge[place]) patch_edges_.push_back(static_cast<uint32_t>(place));
        has_edge[place] = true;
      }
    }
    SortUnique(corners);
    patch_corners_.insert(patch_corners_.end(), corners.begin(), corners.end());
    patch.triangle_end = size(patch_triangles_);
    patch.edge_end = size(patch_edges_);
    patch.vertex_end = size(patch_vertices_);
    patch.corner_end = size(patch_corners_);
    patches_.push_back(patch);
  }
}

void ContactSurface::FindNeighbours(Interruption* interruption) {
  Ask(interruption);
  SeldomInterruption seldom(interruption);
  std::vector<std::vector<uint32_t>> patches_of(rest_positions_.size());
  for (uint32_t p = 0; p < patches_.size(); ++p) {
    for (const uint32_t i : corners_of(patches_[p])) patches_of[i].push_back(p);
  }
  std::vector<self_contact::Box<Vector3d>> boxes(triangles_.size());
  for (uint32_t t = 0; t < triangles_.size(); ++t) {
    for (const uint32_t i : triangles_[t]) boxes[t].Add(rest_positions_[i]);
  }
  const auto is_farther = [&](uint32_t vertex, uint32_t triangle, double distance_m) {
    const Vector3d p = rest_positions_[vertex];
    return !self_contact::AreNear({p, p}, boxes[triangle],
                                  self_contact::Splat<Vector3d>(distance_m));
  };
  const auto gap_of = [&](const ContactPatch& a, const ContactPatch& b) {
    double gap = std::numeric_limits<double>::infinity();
    for (const uint32_t t : triangles_of(b)) {
      for (const uint32_t i : corners_of(a)) {
        seldom.Check();
        const auto& [j, k, l] = triangles_[t];
        if (i == j || i == k || i == l || is_farther(i, t, gap)) continue;
        gap = std::min(gap, RestDistance_m(PairKind::kVertexTriangle, {i, j, k, l}));
      }
    }
    return gap;
  };
  std::vector<self_contact::Box<Vector3d>> edge_boxes(edges_.size());
  for (uint32_t e = 0; e < edges_.size(); ++e) {
    for (const uint32_t i : edges_[e]) edge_boxes[e].Add(rest_positions_[i]);
  }
  const auto edge_gap_of = [&](const ContactPatch& a, const ContactPatch& b) {
    double gap = std::numeric_limits<double>::infinity();
    for (const uint32_t e : edges_of(a)) {
      for (const uint32_t f : edges_of(b)) {
        seldom.Check();
        const auto [i, j] = edges_[e];
        const auto [k, l] = edges_[f];
        if (i == k || i == l || j == k || j == l) continue;
        if (!self_contact::AreNear(edge_boxes[e], edge_boxes[f],
                                   self_contact::Splat<Vector3d>(gap))) {
          continue;
        }
        gap = std::min(gap, RestDistance_m(PairKind::kEdges, {i, j, k, l}));
      }
    }
    return gap;
  };
  neighbour_offsets_.push_back(0);
  for (uint32_t p = 0; p < patches_.size(); ++p) {
    std::vector<uint32_t> others;
    for (const uint32_t i : corners_of(patches_[p])) {
      for (const uint32_t other : patches_of[i]) {
        if (other >= p) others.push_back(other);
      }
    }
    SortUnique(others);
    for (const uint32_t other : others) {
      neighbours_.push_back(
          {p, other,
           std::min(gap_of(patches_[p], patches_[other]), gap_of(patches_[other], patches_[p])),
           edge_gap_of(patches_[p], patches_[other])});
    }
    neighbour_offsets_.push_back(static_cast<uint32_t>(neighbours_.size()));
  }
}

void ContactSurface::FindSurroundings() {
  std::vector<std::vector<uint32_t>> others(patches_.size());
  for (const auto& pair : neighbours_) {
    if (pair.first == pair.second) continue;
    others[pair.first].push_back(pair.second);
    others[pair.second].push_back(pair.first);
  }
  surroundings_offsets_ = {0};
  for (const std::vector<uint32_t>& of_patch : others) {
    surroundings_.insert(surroundings_.end(), of_patch.begin(), of_patch.end());
    surroundings_offsets_.push_back(static_cast<uint32_t>(surroundings_.size()));
  }
}

const ContactNeighbours* ContactSurface::Neighbours(uint32_t patch, uint32_t other) const {
  const auto [first, second] = std::minmax(patch, other);
  for (uint32_t k = neighbour_offsets_[first]; k < neighbour_offsets_[first + 1]; ++k) {
    if (neighbours_[k].second == second) return &neighbours_[k];
  }
  return nullptr;
}

// Halves by the middles of the patches along the widest axis.
void ContactSurface::BuildTree() {
  if (patches_.empty()) return;
  std::vector<Vector3d> centers;
  for (const ContactPatch& patch : patches_) {
    self_contact::Box<Vector3d>& box = rest_boxes_.emplace_back();
    for (const uint32_t i : corners_of(patch)) box.Add(rest_positions_[i]);
    centers.push_back(box.low + box.high);
  }
  std::vector<uint32_t> order(patches_.size());
  std::iota(order.begin(), order.end(), 0u);
  struct Open {
    uint32_t node;
    size_t begin, end;
  };
  nodes_.push_back({});
  std::vector<Open> open = {{0, 0, order.size()}};
  while (!open.empty()) {
    const auto [node, begin, end] = open.back();
    open.pop_back();
    if (end - begin == 1) {
      nodes_[node] = {0, order[begin]};
      continue;
    }
    self_contact::Box<Vector3d> box;
    for (size_t k = begin; k < end; ++k) box.Add(centers[order[k]]);
    const Vector3d size = box.high - box.low;
    const int axis =
        size[0] >= size[1] ? (size[0] >= size[2] ? 0 : 2) : (size[1] >= size[2] ? 1 : 2);
    const size_t middle = begin + (end - begin) / 2;
    std::nth_element(order.begin() + static_cast<std::ptrdiff_t>(begin),
                     order.begin() + static_cast<std::ptrdiff_t>(middle),
                     order.begin() + static_cast<std::ptrdiff_t>(end), [&](uint32_t a, uint32_t b) {
                       const double at_a = centers[a][axis], at_b = centers[b][axis];
                       return at_a < at_b || (at_a == at_b && a < b);
                     });
    const auto child = static_cast<uint32_t>(nodes_.size());
    nodes_[node] = {child, 0};
    nodes_.insert(nodes_.end(), 2, ContactNode{});
    open.push_back({child, begin, middle});
    open.push_back({child + 1, middle, end});
  }
}

double ContactSurface::RestDistance_m(PairKind kind,
                                      const std::array<uint32_t, 4>& particles) const {
  // The first corner and the last one belong to different primitives.
  if (member_of_particle(particles[0]) != member_of_particle(particles[3])) {
    return std::numeric_limits<double>::infinity();
  }
  const std::array<Vector3d, 4> p = {rest_positions_[particles[0]], rest_positions_[particles[1]],
                                     rest_positions_[particles[2]], rest_positions_[particles[3]]};
  return self_contact::Length(self_contact::Closest(kind, p).difference);
}

}  // namespace drape
