// What of a model, or of several, can touch: vertices, edges and triangles, in patches and a tree.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/made_per_model.h"
#include "server/scene/scene_model.h"
#include "server/solver/self_contact/closest_points.h"
#include "server/solver/self_contact/flat_sheet.h"

namespace drape {

// Triangles of a patch at most. More: coarser boxes, and more of a cloth that is folded counts as
// near; fewer: a deeper tree, and more pairs of neighbours.
inline constexpr size_t kPatchTriangles = 8;

// A connected handful of triangles. Each vertex and edge with a triangle belongs to one patch.
// Ranges of the lists of ContactSurface.
struct ContactPatch {
  uint32_t triangle_begin = 0, triangle_end = 0;
  uint32_t edge_begin = 0, edge_end = 0;
  uint32_t vertex_begin = 0, vertex_end = 0;
  uint32_t corner_begin = 0, corner_end = 0;  // all vertices of its triangles
};

// Patches that share a vertex, or one patch twice.
struct ContactNeighbours {
  uint32_t first, second;  // patches, first <= second
  // Smallest distance in the rest shape of a vertex of one from a triangle of the other that it
  // does not belong to [m].
  double rest_gap_m;
  // The same of two edges that each belong to one of the two patches [m].
  double rest_edge_gap_m;
};

// A node of the tree over the patches. Children come after their parent.
struct ContactNode {
  uint32_t first_child;  // the second is the next; 0: a leaf
  uint32_t patch;        // of a leaf
};

class ContactSurface;

// One of the cloths of a world.
struct SurfaceMember {
  const ContactSurface* surface;  // of one model
  bool touches_itself;
};

// Constant after construction; safe to share between threads.
class ContactSurface {
 public:
  // `interruption`: asked now and then; null: nobody is.
  explicit ContactSurface(const SceneModel& model, Interruption* interruption = nullptr);
  // That of several cloths, particle after particle in this order. Each of them touches the others.
  explicit ContactSurface(std::span<const SurfaceMember> members,
                          Interruption* interruption = nullptr);

  uint32_t particle_count() const { return static_cast<uint32_t>(rest_positions_.size()); }
  // [particle_count] [m]
  std::span<const self_contact::Vector3d> rest_positions() const { return rest_positions_; }
  std::span<const std::array<uint32_t, 3>> triangles() const { return triangles_; }
  std::span<const std::array<uint32_t, 2>> edges() const { return edges_; }  // ascending
  std::span<const ContactPatch> patches() const { return patches_; }
  std::span<const ContactNode> nodes() const { return nodes_; }  // the root first
  // Of every patch with itself and with those that share a vertex with it.
  std::span<const ContactNeighbours> neighbours() const { return neighbours_; }
  // Of two patches; null if they share no vertex.
  const ContactNeighbours* Neighbours(uint32_t patch, uint32_t other) const;
  // The patches that share a vertex with one.
  std::span<const uint32_t> surroundings_of(uint32_t patch) const {
    return Range(surroundings_, surroundings_offsets_[patch], surroundings_offsets_[patch + 1]);
  }
  bool AreNeighbours(uint32_t patch, uint32_t other) const {
    return Neighbours(patch, other) != nullptr;
  }

  // Lists that patches have ranges of.
  std::span<const uint32_t> patch_triangles() const { return patch_triangles_; }
  std::span<const uint32_t> patch_edges() const { return patch_edges_; }
  std::span<const uint32_t> patch_vertices() const { return patch_vertices_; }
  std::span<const uint32_t> triangles_of(const ContactPatch& patch) const {
    return Range(patch_triangles_, patch.triangle_begin, patch.triangle_end);
  }
  std::span<const uint32_t> edges_of(const ContactPatch& patch) const {
    return Range(patch_edges_, patch.edge_begin, patch.edge_end);
  }
  std::span<const uint32_t> vertices_of(const ContactPatch& patch) const {
    return Range(patch_vertices_, patch.vertex_begin, patch.vertex_end);
  }
  std::span<const uint32_t> corners_of(const ContactPatch& patch) const {
    return Range(patch_corners_, patch.corner_begin, patch.corner_end);
  }

  // The cloths that it is of: of one, all particles and patches are those of member 0.
  uint32_t member_count() const {
    return std::max(1u, static_cast<uint32_t>(touches_itself_.size()));
  }
  uint32_t member_of_particle(uint32_t particle) const {
    return particle_members_.empty() ? 0 : particle_members_[particle];
  }
  uint32_t member_of_patch(uint32_t patch) const {
    return particle_members_.empty() ? 0 : particle_members_[patch_corners_[corner_begin(patch)]];
  }
  // Whether the cloths of what is below two nodes, or the one cloth of both, touch.
  bool MayTouchBelow(uint32_t node, uint32_t other) const {
    if (node_members_.empty() || node_members_[node] != node_members_[other]) return true;
    return node_members_[node] == kSeveral || touches_itself_[node_members_[node]];
  }

  // Distance of the primitives of a pair in the rest shape [m]; infinite between two cloths.
  double RestDistance_m(self_contact::PairKind kind,
                        const std::array<uint32_t, 4>& particles) const;
  // Whether primitives of two patches may be nearer than `distance_m` in the rest shape.
  bool MayBeNearAtRest(uint32_t patch, uint32_t other, double distance_m) const {
    if (member_of_patch(patch) != member_of_patch(other)) return false;
    return self_contact::AreNear(rest_boxes_[patch], rest_boxes_[other],
                                 self_contact::Splat<self_contact::Vector3d>(distance_m));
  }
  // Of one cloth that is one.
  const std::optional<self_contact::FlatSheet>& flat_sheet() const { return flat_sheet_; }
  // The other two corners of each triangle at a particle.
  std::span<const std::array<uint32_t, 2>> corners_around(uint32_t particle) const {
    return std::span(corners_around_)
        .subspan(corners_around_offsets_[particle],
                 corners_around_offsets_[particle + 1] - corners_around_offsets_[particle]);
  }
  // Height of a triangle above its longest edge in the rest shape [m].
  double rest_height_m(uint32_t triangle) const { return rest_heights_[triangle]; }

 private:
  static constexpr uint32_t kSeveral = UINT32_MAX;  // a node above those of several members

  uint32_t corner_begin(uint32_t patch) const { return patches_[patch].corner_begin; }
  static std::span<const uint32_t> Range(const std::vector<uint32_t>& list, uint32_t begin,
                                         uint32_t end) {
    return std::span(list).subspan(begin, end - begin);
  }
  // The steps of construction, in this order.
  void FindEdges();
  void FindCornersAround();
  void GrowPatches(Interruption* interruption);
  void FillPatches(const std::vector<std::vector<uint32_t>>& triangles_of_patches,
                   Interruption* interruption);
  void FindNeighbours(Interruption* interruption);
  void FindSurroundings();
  void BuildTree();
  // The same for several.
  void Append(const SurfaceMember& member, Interruption* interruption);
  void JoinTrees(std::span<const SurfaceMember> members);

  std::vector<self_contact::Vector3d> rest_positions_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  std::vector<double> rest_heights_;
  std::vector<std::array<uint32_t, 2>> edges_;
  std::vector<std::array<uint32_t, 2>> corners_around_;
  std::vector<uint32_t> corners_around_offsets_;  // [particle_count + 1]
  std::vector<ContactPatch> patches_;
  std::vector<self_contact::Box<self_contact::Vector3d>> rest_boxes_;  // [patch_count]
  std::vector<uint32_t> patch_triangles_, patch_edges_, patch_vertices_, patch_corners_;
  std::vector<ContactNeighbours> neighbours_;
  std::vector<uint32_t> neighbour_offsets_;  // [patch_count + 1] of neighbours_, by their first
  std::vector<uint32_t> surroundings_, surroundings_offsets_;  // of neighbours_, by either
  std::vector<ContactNode> nodes_;
  std::optional<self_contact::FlatSheet> flat_sheet_;
  // Only of several: of each particle, node and member.
  std::vector<uint32_t> particle_members_;
  std::vector<uint32_t> node_members_;
  std::vector<bool> touches_itself_;
};

// The distance at which two cloths touch: half the sum of their thicknesses.
template <class Real>
struct Thicknesses {
  Real most = 0;                          // of any two [m]
  std::span<const Real> of_members = {};  // [member_count] [m]; empty: of all of them `most`

  Thicknesses() = default;
  Thicknesses(Real of_all) : most(of_all) {}
  Thicknesses(Real largest, std::span<const Real> each) : most(largest), of_members(each) {}

  Real Of(const ContactSurface& surface, uint32_t patch, uint32_t other) const {
    if (of_members.empty()) return most;
    return (of_members[surface.member_of_patch(patch)] +
            of_members[surface.member_of_patch(other)]) /
           2;
  }
};

using ContactSurfaceCache = MadePerModel<ContactSurface>;

}  // namespace drape
